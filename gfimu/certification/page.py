"""The certificate as one self-contained, print-ready HTML page."""

from __future__ import annotations

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, select_autoescape

from gfimu.certification.certificate import Certificate
from gfimu.files.atomic_file import atomic_folder

__all__ = ["FILES", "certificate_html", "write_certificate"]

FILES = {"certificate.json": "certificate", "certificate.html": "page"}
"""What the folder of a certificate holds, and what it is called."""


def write_certificate(directory: str | Path, certificate: Certificate) -> dict[str, Path]:
    """Write all files of a certificate to a folder; what stands there is replaced only when all are made."""
    folder = Path(directory)
    page = certificate_html(certificate)
    with atomic_folder(folder) as made:
        certificate.save(made / "certificate.json")
        (made / "certificate.html").write_text(page, encoding="utf-8")
    return {meaning: folder / name for name, meaning in FILES.items()}


def certificate_html(certificate: Certificate) -> str:
    """Return the certificate as HTML without references to anything outside it."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("certificate.html.j2").render(certificate=certificate)
