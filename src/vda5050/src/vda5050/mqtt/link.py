# SPDX-License-Identifier: BSD-3-Clause
"""One connection to an MQTT broker: it comes back by itself, and says when it does."""

import logging
import ssl
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import attrs
from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.reasoncodes import ReasonCode

from hive_common.structuring import Name, between
from vda5050.errors import BrokerError

_RETRY = (1, 8)
"""Shortest and longest time between attempts to connect [s]."""
_QUEUED = 10_000
"""Messages that may wait for being sent; a broker that is gone must not fill the memory."""


@attrs.frozen(kw_only=True)
class BrokerSettings:
    """Which broker, and as whom; the keys of `broker` in a fleet file."""

    host: Name = "127.0.0.1"
    port: Annotated[int, between(1, 65535, "port of the broker")] = 1883
    user: str | None = None
    password_file: str | None = None
    """File whose first line is the password: fleet files and process lists are read by many."""
    ca_file: str | None = None
    """Certificates that the broker's must be signed by; with it the connection is encrypted."""
    cert_file: str | None = None
    """The client's own certificate, where the broker wants one."""
    key_file: str | None = None
    keep_alive: Annotated[int, between(1, 600, "seconds between signs of life")] = 10


@attrs.frozen
class Will:
    """What the broker says for a client that it has lost."""

    topic: str
    payload: bytes
    qos: int = 1
    retain: bool = True


class Link:
    """Publishes and subscribes; a broker that goes away is waited for.

    Callbacks come from the connection's own thread, one at a time.

    Args:
        settings: Which broker.
        client_id: This client's name at the broker, unique there.
        on_message: Called with the topic and payload of each message.
        on_change: Called with True when connected, with False when not any more.
        will: What the broker says when it loses this client.
    """

    def __init__(
        self,
        settings: BrokerSettings,
        client_id: str,
        on_message: Callable[[str, bytes], None],
        on_change: Callable[[bool], None] = lambda _: None,
        will: Will | None = None,
    ) -> None:
        self._settings = settings
        self._topics: dict[str, int] = {}
        self._on_message, self._on_change = on_message, on_change
        self._client = _client(client_id)
        self._client.on_connect = self._connected
        self._client.on_disconnect = self._disconnected
        self._client.on_message = self._received
        self._client.max_queued_messages_set(_QUEUED)
        self._client.reconnect_delay_set(*_RETRY)
        if settings.user is not None:
            self._client.username_pw_set(settings.user, _password(settings))
        if settings.ca_file is not None:
            self._client.tls_set_context(_context(settings))
        if will is not None:
            self._client.will_set(will.topic, will.payload, will.qos, will.retain)

    def start(self) -> None:
        """Begin to connect; the broker need not be there yet."""
        settings = self._settings
        self._client.connect_async(settings.host, settings.port, settings.keep_alive)
        self._client.loop_start()

    def stop(self) -> None:
        """Say goodbye to the broker, which then keeps the last will to itself."""
        self._client.disconnect()
        self._client.loop_stop()

    def subscribe(self, topics: Sequence[str], qos: int = 0) -> None:
        """Hear topics, now and after every reconnection; `+` and `#` are understood."""
        self._topics |= dict.fromkeys(topics, qos)
        if self._client.is_connected():
            self._client.subscribe([(topic, qos) for topic in topics])

    def publish(self, topic: str, payload: bytes, qos: int = 0, *, retain: bool = False) -> bool:
        """Send a message, and return whether a broker was there.

        Without a broker nothing is kept for later: an order is out of date by then, and what the
        receiver lacks is sent again by who knows it.
        """
        if not self._client.is_connected():
            return False
        sent = self._client.publish(topic, payload, qos, retain)
        return bool(sent.rc == paho.MQTT_ERR_SUCCESS)

    @property
    def connected(self) -> bool:
        """Whether there is a broker."""
        return bool(self._client.is_connected())

    def _connected(
        self,
        _client: object,
        _data: object,
        _flags: object,
        reason: ReasonCode,
        _properties: object,
    ) -> None:
        if reason.is_failure:
            logging.getLogger(__name__).warning(
                "the broker %s:%d refuses us: %s; check user, password_file and its access rules",
                self._settings.host,
                self._settings.port,
                reason,
            )
            return
        if self._topics:
            self._client.subscribe(list(self._topics.items()))
        self._on_change(True)

    def _disconnected(self, *_: object) -> None:
        self._on_change(False)

    def _received(self, _client: object, _data: object, message: paho.MQTTMessage) -> None:
        try:
            topic = message.topic
        except UnicodeDecodeError:
            return  # no topic of ours is written so
        self._on_message(topic, bytes(message.payload))


def _client(client_id: str) -> paho.Client:
    """Return a client of MQTT 3.1.1, which every broker and AGV speaks."""
    callbacks = CallbackAPIVersion.VERSION2
    return paho.Client(callbacks, client_id, clean_session=True, protocol=paho.MQTTv311)


def _password(settings: BrokerSettings) -> str | None:
    if settings.password_file is None:
        return None
    try:
        with open(settings.password_file, encoding="utf-8") as file:  # noqa: PTH123  (a text)
            return file.readline().rstrip("\r\n")
    except OSError as error:
        raise BrokerError(
            f"password_file {settings.password_file} cannot be read: {error.strerror}"
        ) from None


def _context(settings: BrokerSettings) -> Any:  # noqa: ANN401  (an SSL context)
    try:
        context = ssl.create_default_context(cafile=settings.ca_file)
        if settings.cert_file is not None:
            context.load_cert_chain(settings.cert_file, settings.key_file)
    except (OSError, ssl.SSLError) as error:
        raise BrokerError(
            f"the files for an encrypted connection cannot be used: {error}; "
            "check ca_file, cert_file and key_file"
        ) from None
    return context
