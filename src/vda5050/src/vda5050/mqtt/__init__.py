"""The connection to an MQTT broker. Nothing here knows what the messages mean."""
