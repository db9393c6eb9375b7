# SPDX-License-Identifier: BSD-3-Clause
"""Issues and reads X.509 certificates, by the library `cryptography`.

A member's certificate names the site as its organization (O), the role as the unit (OU), and as
its common name (CN) the member and some random letters, such as `robot2.5f1d09ab`. Zenoh's access
control knows members by these common names. A renewed certificate has the same one. When a member
is revoked and added again it gets another, so nobody can use the old certificate.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from blackboard.zenoh.access import Role
from fleet_manager.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

_BEHIND = timedelta(days=1)
"""A certificate is valid from this long ago, for machines whose clocks are behind."""

_LETTERS = 4
"""Random bytes of a common name."""


@dataclass(frozen=True)
class Authority:
    """Who issues a site's certificates: its own certificate, and the key to sign others with."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @property
    def site(self) -> str:
        """The name of the site."""
        return _text(self.certificate, NameOID.ORGANIZATION_NAME)

    @property
    def until(self) -> datetime:
        """When it ends, and with it all certificates that it has issued."""
        return self.certificate.not_valid_after_utc


@dataclass(frozen=True)
class Issued:
    """A member's certificate, without its key.

    Attributes:
        name: The member.
        role: What it may do.
        common_name: As the access control knows the certificate.
        until: When it ends.
    """

    name: str
    role: Role
    common_name: str
    until: datetime

    def is_valid(self, now: datetime) -> bool:
        """Return whether it has not ended."""
        return now < self.until


@dataclass(frozen=True)
class Pair:
    """A certificate and its key, as the text of two files (PEM)."""

    certificate: bytes
    key: bytes


def new_authority(site: str, days: int, now: datetime) -> Pair:
    """Make a site's authority, which is valid for some days."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = _named(site, "authority", site)
    usage = x509.KeyUsage(
        key_cert_sign=True,
        crl_sign=True,
        digital_signature=False,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )
    certificate = (
        _begun(name, name, key, now, now + timedelta(days=days))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    return _pair(certificate, key)


def new_common_name(name: str) -> str:
    """Return a common name that no certificate of a member has had before."""
    return f"{name}.{secrets.token_hex(_LETTERS)}"


def issue(authority: Authority, common_name: str, role: Role, days: int, now: datetime) -> Pair:
    """Issue a certificate to a member, for some days, but no longer than the authority's own."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = common_name.rpartition(".")[0]
    subject = _named(authority.site, role.value, common_name)
    until = min(now + timedelta(days=days), authority.until)
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]
    certificate = (
        _begun(subject, authority.certificate.subject, key, now, until)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
        .sign(authority.key, hashes.SHA256())
    )
    return _pair(certificate, key)


def read_authority(certificate: Path, key: Path) -> Authority:
    """Read an authority.

    Raises:
        InputError: A file cannot be read, or is not what it should be.
    """
    try:
        loaded = load_pem_private_key(key.read_bytes(), password=None)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{key} cannot be read as a private key: {error}") from None
    if not isinstance(loaded, ec.EllipticCurvePrivateKey):
        raise InputError(f"{key} is a key of another kind; put back what `hive certs new` made")
    return Authority(_certificate_in(certificate), loaded)


def read_issued(path: Path) -> Issued:
    """Read a member's certificate.

    Raises:
        InputError: The file cannot be read, or no `hive certs` has issued it.
    """
    certificate = _certificate_in(path)
    common_name = _text(certificate, NameOID.COMMON_NAME)
    role = _text(certificate, NameOID.ORGANIZATIONAL_UNIT_NAME)
    name, dot, _ = common_name.rpartition(".")
    if not dot or role not in {each.value for each in Role}:
        raise InputError(f"{path} was not issued by `hive certs`; move it away")
    return Issued(name, Role(role), common_name, certificate.not_valid_after_utc)


def _certificate_in(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a certificate: {error}") from None


def _named(site: str, unit: str, name: str) -> x509.Name:
    return x509.Name(
        [
            x509.NameAttribute(NameOID.ORGANIZATION_NAME, site),
            x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, unit),
            x509.NameAttribute(NameOID.COMMON_NAME, name),
        ]
    )


def _text(certificate: x509.Certificate, part: x509.ObjectIdentifier) -> str:
    found = certificate.subject.get_attributes_for_oid(part)
    return str(found[0].value) if found else ""


def _begun(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    until: datetime,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _BEHIND)
        .not_valid_after(until)
    )


def _pair(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> Pair:
    return Pair(
        certificate.public_bytes(Encoding.PEM),
        key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()),
    )


def today() -> datetime:
    """Return the present time."""
    return datetime.now(timezone.utc)
