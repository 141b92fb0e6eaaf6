"""What a phone needs: this machine's addresses, a certificate of its own, a code to scan."""

from __future__ import annotations

import contextlib
import datetime
import io
import ipaddress
import os
import socket
from dataclasses import dataclass
from pathlib import Path

DAYS = 90
"""Days for which a certificate is valid; Apple refuses more than 825."""
_ELSEWHERE = ("192.0.2.1", 9)
"""An address of a documentation network (RFC 5737): no packet is sent to it."""
_OWNER_ONLY = 0o600
"""Permissions of the key."""
_SCALE = 6
"""Size of a module of the code in the page, pixels."""


@dataclass(frozen=True)
class Certificate:
    """Files of a certificate and its fingerprint, which a careful user compares."""

    certificate: Path
    key: Path
    fingerprint: str


def lan_addresses() -> list[str]:
    """Return the IPv4 addresses by which others reach this machine, the likeliest first."""
    found: list[str] = []
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial,
        contextlib.suppress(OSError),  # no network at all
    ):
        trial.connect(_ELSEWHERE)
        found.append(trial.getsockname()[0])
    with contextlib.suppress(OSError):  # the machine's name has no address
        own = socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
        found += [str(entry[4][0]) for entry in own]
    return [a for a in dict.fromkeys(found) if not ipaddress.ip_address(a).is_loopback]


def make_certificate(folder: Path, addresses: list[str]) -> Certificate:
    """Write a new certificate for the addresses, signed by itself, and its key (mode 0600).

    ECDSA on P-256, names in subjectAltName, extended use serverAuth: what iOS asks of one.
    """
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "hairkit studio")])
    now = datetime.datetime.now(datetime.UTC)
    names: list[x509.GeneralName] = [x509.DNSName("localhost")]
    names += [x509.IPAddress(ipaddress.ip_address(a)) for a in ("127.0.0.1", *addresses)]
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))
        .not_valid_after(now + datetime.timedelta(days=DAYS))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    files = folder / "certificate.pem", folder / "key.pem"
    encoding = serialization.Encoding.PEM
    _write_private(files[0], certificate.public_bytes(encoding))
    _write_private(
        files[1],
        key.private_bytes(
            encoding, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        ),
    )
    digest = certificate.fingerprint(hashes.SHA256()).hex(":").upper()
    return Certificate(*files, digest)


def qr_svg(link: str) -> str:
    """Return the code of a link as SVG, dark on light."""
    import segno

    return str(segno.make(link, error="m").svg_inline(scale=_SCALE, dark="#101418", light="#fff"))


def qr_text(link: str) -> str:
    """Return the code of a link for a terminal."""
    import segno

    text = io.StringIO()
    segno.make(link, error="l").terminal(text, compact=True)
    return text.getvalue()


def _write_private(path: Path, data: bytes) -> None:
    path.unlink(missing_ok=True)
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _OWNER_ONLY)
    with os.fdopen(handle, "wb") as file:
        file.write(data)
