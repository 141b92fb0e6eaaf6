"""Laws of what a phone needs: a certificate that browsers accept, codes that are read."""

from __future__ import annotations

import datetime
import ipaddress
import os
import ssl
import stat
from pathlib import Path

import cv2
import numpy as np

from hairkit.studio.lan import DAYS, lan_addresses, make_certificate, qr_svg, qr_text

LINK = "https://192.168.1.20:8420/#t=abcdefghijklmnopqrstuvwxyz012345"


def test_the_certificate_is_what_phones_accept(tmp_path: Path) -> None:
    """Addresses in subjectAltName, extended use serverAuth, 90 days, a key for the owner alone."""
    from cryptography import x509
    from cryptography.x509.oid import ExtendedKeyUsageOID

    made = make_certificate(tmp_path, ["192.168.1.20"])
    certificate = x509.load_pem_x509_certificate(made.certificate.read_bytes())
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert ipaddress.ip_address("192.168.1.20") in names.get_values_for_type(x509.IPAddress)
    assert "localhost" in names.get_values_for_type(x509.DNSName)
    uses = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert list(uses) == [ExtendedKeyUsageOID.SERVER_AUTH]
    span = certificate.not_valid_after_utc - certificate.not_valid_before_utc
    assert span <= datetime.timedelta(days=DAYS + 1)
    assert stat.S_IMODE(os.stat(made.key).st_mode) == 0o600
    ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(made.certificate, made.key)
    assert len(made.fingerprint.split(":")) == 32


def test_codes_are_read_back(tmp_path: Path) -> None:
    """The code in the page holds the link; that of the terminal is drawn by its characters."""
    import segno

    assert qr_svg(LINK).startswith("<svg")
    assert len(qr_text(LINK).splitlines()) > 10
    path = tmp_path / "code.png"
    segno.make(LINK, error="m").save(str(path), scale=6, border=4)
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    assert cv2.QRCodeDetector().detectAndDecode(np.asarray(picture))[0] == LINK


def test_addresses_are_others_ways_to_this_machine() -> None:
    """Loopback is no address for a phone."""
    assert all(not ipaddress.ip_address(a).is_loopback for a in lan_addresses())
