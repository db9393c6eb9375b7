"""The Qt windows; nothing else imports them."""
