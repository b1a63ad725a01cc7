"""Build the firmware with the C compiler that comes in the `ziglang` wheel, and know what was built from what."""

from __future__ import annotations

import hashlib
import struct
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tomli_w
from numpy.typing import NDArray

from firmware_bridge.lpc1768.elf import ElfImage
from gfimu.base.child_process import run_module
from gfimu.base.declared import Declared, Table, figure, figures
from gfimu.base.errors import GfimuError, InputError, did_you_mean
from gfimu.base.files.atomic_file import atomic_path, write_text
from gfimu.base.optional_packages import require
from gfimu.base.results import TableResult, one_row

__all__ = [
    "IMAGES",
    "BuildReport",
    "build",
    "check_image",
    "compiler_version",
    "image_path",
    "named_image",
    "source_hash",
]

FOLDER = Path(__file__).resolve().parent
SOURCES = FOLDER / "src"

IMAGES: dict[str, tuple[str, ...]] = {
    "gfimu": ("startup.c", "board.c", "core.c", "adxl345.c"),
    "selfcheck": ("startup.c", "selfcheck.c"),
}
"""Images and the C files that make them."""

_FLAGS = (
    "-target", "thumb-freestanding-eabi", "-mcpu=cortex_m3", "-mthumb", "-std=c11", "-O2", "-flto", "-g0",
    "-ffreestanding", "-fno-builtin", "-fno-sanitize=undefined", "-fno-unwind-tables",
    "-fno-asynchronous-unwind-tables", "-ffunction-sections", "-fdata-sections",
    "-Wall", "-Wextra", "-Wconversion", "-Werror", "-nostdlib",
    "-Wl,-T,lpc1768.ld", "-Wl,--gc-sections", "-Wl,-e,Reset_Handler",
)  # fmt: skip
ARRAY_SYMBOL = "gfimu_array"
"""Where the name of the array stands in an image (core.c)."""

_LONGEST_NAME = 24  # bytes of a frame's payload
_VECTORS_SUMMED = 7
_CODE_READ_PROTECTION = 0x2FC  # UM10360 32.6
_UNPROTECTED = b"\xff\xff\xff\xff"


@dataclass(frozen=True)
class BuildReport(Declared, TableResult):
    """A built image."""

    name: Annotated[str, figure("Name of the image.")]
    elf: Annotated[Path, figure("ELF file, with symbols.")]
    binary: Annotated[Path, figure("Raw image for the flash.")]
    sha256: Annotated[str, figure("Hash of the ELF file.", head="SHA-256")]
    source_sha256: Annotated[str, figure("Hash of the sources, linker script, flags and definitions.")]
    compiler: Annotated[str, figure("Compiler and version.", head="compiler")]
    text_bytes: Annotated[int, figure("Code and constants, in flash.", "bytes", head="code and constants")]
    data_bytes: Annotated[int, figure("Initialised memory.", "bytes", head="initialised memory")]
    bss_bytes: Annotated[int, figure("Zeroed memory, without the stack.", "bytes", head="zeroed memory")]
    defines: Annotated[Mapping[str, str], figure("Preprocessor definitions beyond the defaults.")] = field(
        default_factory=dict
    )

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: files, hashes, compiler, bytes of flash and memory."""
        return one_row({name: value for name, value in vars(self).items() if name != "defines"})

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read."""
        yield figures(self._heading(), self)

    def _heading(self) -> str:
        return f"Image {self.name}"

    def _facts(self) -> list[tuple[str, str]]:
        files = [("ELF file", str(self.elf)), ("image for the flash", str(self.binary))]
        return [*self.facts(), *files, *self.defines.items()]

    def _shown(self) -> None:
        return None


def image_path(name: str = "gfimu") -> Path:
    """Path of a committed image; raises `InputError` that lists the images."""
    if name not in IMAGES:
        remedy = did_you_mean(name, IMAGES)
        raise InputError(f"unknown image {name!r}; valid: {', '.join(IMAGES)}, or the path of an ELF file{remedy}")
    return FOLDER / "image" / f"{name}.elf"


def compiler_version() -> str:
    """Version of the installed compiler.

    Raises
    ------
    InputError
        If `ziglang` is not installed; the message says what to install.
    """
    require("building the firmware", "ziglang")
    return "ziglang " + _zig("version", cwd=FOLDER).strip()


def source_hash(name: str, defines: Mapping[str, str] | None = None) -> str:
    """SHA-256 over everything that decides the bytes of an image, except the compiler's version."""
    digest = hashlib.sha256()
    for file in sorted(SOURCES.iterdir()):
        digest.update(file.name.encode() + b"\0" + file.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    digest.update(repr((name, IMAGES[name], _FLAGS, sorted((defines or {}).items()))).encode())
    return digest.hexdigest()


def array_definition(array: str) -> dict[str, str]:
    """Return the preprocessor definition by which a board states its array; none without a name.

    Raises
    ------
    InputError
        If a frame has no room for the name, or it holds other characters than printable ASCII.
    """
    if not array:
        return {}
    if len(array) > _LONGEST_NAME or not (array.isascii() and array.isprintable()) or set(array) & set(' "\\'):
        raise InputError(
            f"array {array!r}: a board can state a name of at most {_LONGEST_NAME} plain characters; "
            "give the array a shorter one, or name it with gfimu record --array"
        )
    return {"GFIMU_ARRAY": f'"{array}"'}


def named_image(image: ElfImage, array: str) -> ElfImage:
    """Return a finished image that states another array; as it is if it has no place for a name."""
    array_definition(array)  # whether it is a name
    address = image.symbols.get(ARRAY_SYMBOL)
    return image if address is None else image.with_bytes(address, array.encode().ljust(_LONGEST_NAME, b"\0"))


def build(
    name: str = "gfimu",
    out: str | Path | None = None,
    *,
    array: str = "",
    defines: Mapping[str, str] | None = None,
) -> BuildReport:
    """Compile and link one image; write ``NAME.elf``, ``NAME.bin`` and ``NAME.toml``.

    Parameters
    ----------
    name : str
        Image in `IMAGES`.
    out : str or Path, optional
        Folder for the results, made if it isn't there; by default the package's own ``image`` folder.
    array : str
        Name of the array on the board, which the board then states (`array_definition`).
    defines : mapping of str to str, optional
        Preprocessor definitions, such as ``{"GFIMU_SPI_HZ": "100000U"}``.

    Raises
    ------
    InputError
        If the compiler is not installed, the image is unknown or the board can't state that name.
    GfimuError
        If the sources do not compile (the message holds the compiler's), or code lies in the code-protection word.
    """
    image_path(name)
    compiler = compiler_version()
    defines = {**array_definition(array), **(defines or {})}
    folder = Path(out) if out is not None else FOLDER / "image"
    identity = source_hash(name, defines)
    options = [f"-D{key}={value}" for key, value in sorted(defines.items())]
    options.append(f"-DGFIMU_BUILD_ID=0x{identity[:8]}U")
    with tempfile.TemporaryDirectory() as scratch:
        linked = Path(scratch) / f"{name}.elf"
        _zig("cc", *_FLAGS, *options, *IMAGES[name], "-o", str(linked), cwd=SOURCES)
        content = _with_boot_checksum(linked.read_bytes())
    image = ElfImage.parse(content, name)
    if image.flash_bytes()[_CODE_READ_PROTECTION:][:4] != _UNPROTECTED:
        raise GfimuError(
            f"{name}: the code-protection word at {_CODE_READ_PROTECTION:#x} is not 0xFFFFFFFF; "
            "reserve it in the linker script"
        )
    elf, binary = folder / f"{name}.elf", folder / f"{name}.bin"
    for path, data in ((elf, content), (binary, image.flash_bytes())):
        folder.mkdir(exist_ok=True)
        with atomic_path(path) as temporary:
            temporary.write_bytes(data)
    text, data_bytes, bss = image.section_sizes()
    report = BuildReport(
        name, elf, binary, hashlib.sha256(content).hexdigest(), identity, compiler, text, data_bytes, bss, defines
    )
    facts = {
        "compiler": compiler,
        "sha256": report.sha256,
        "source_sha256": identity,
        "text_bytes": text,
        "data_bytes": data_bytes,
        "bss_bytes": bss,
        "defines": dict(report.defines),
    }
    write_text(folder / f"{name}.toml", tomli_w.dumps(facts))
    return report


def check_image(name: str = "gfimu") -> dict[str, str | bool]:
    """Compare a committed image with its recorded hash and with the sources that are here now."""
    elf = image_path(name)
    facts = tomllib.loads(elf.with_suffix(".toml").read_text(encoding="utf-8"))
    return {
        "compiler": facts["compiler"],
        "image_as_recorded": hashlib.sha256(elf.read_bytes()).hexdigest() == facts["sha256"],
        "sources_as_recorded": source_hash(name, facts["defines"]) == facts["source_sha256"],
    }


def _zig(*arguments: str, cwd: Path) -> str:
    run = run_module("ziglang", *arguments, cwd=cwd, text=True)
    if run.returncode:
        raise GfimuError(f"the C compiler failed:\n{run.stderr.strip()}")
    return run.stdout


def _with_boot_checksum(content: bytes) -> bytes:
    """Make the first eight words of the vector table sum to zero by its word 7 (boot ROM, UM10360 32.3.1.1)."""
    offset = ElfImage.parse(content, "image").file_offset(0)
    words = struct.unpack_from(f"<{_VECTORS_SUMMED}I", content, offset)
    patched = bytearray(content)
    struct.pack_into("<I", patched, offset + 4 * _VECTORS_SUMMED, -sum(words) & 0xFFFFFFFF)
    return bytes(patched)
