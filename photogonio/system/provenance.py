"""Where a result came from: program, command and hashes of the inputs; nothing that differs between runs."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from photogonio import __version__


@dataclass(frozen=True, slots=True)
class Provenance:
    """``command`` has what bears on the result, by the inputs' own names: no folders, workers or outputs."""

    command: str
    inputs: Mapping[str, str] = field(default_factory=dict)  # name -> SHA-256

    def to_dict(self) -> dict[str, object]:
        return {
            "program": "photogonio",
            "version": __version__,
            "command": self.command,
            "inputs": dict(self.inputs),
        }

    def to_text(self) -> str:
        """As one line of JSON."""
        return json.dumps(self.to_dict(), ensure_ascii=False)


def canonical_command(command: str, subject: str, options: Mapping[str, object]) -> str:
    """The command as one line; options that are None or "auto" are left out."""
    words = ["photogonio", command, subject]
    for name, value in options.items():
        if value is None or value == "auto":
            continue
        text = ",".join(map(str, value)) if isinstance(value, (tuple, list)) else str(value)
        words.append(f"--{name} {text}")
    return " ".join(words)


def hash_file(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal. Raises OSError if it cannot be read; a pipe would be waited for."""
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "no ordinary file", str(path))
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def hash_inputs(path: Path) -> dict[str, str]:
    """:func:`hash_file` of a file, or of each file of a folder, by name."""
    files = sorted(file for file in path.iterdir() if file.is_file()) if path.is_dir() else [path]
    return {file.name: hash_file(file) for file in files}


def hash_files(paths: Iterable[Path], *, workers: int = 1) -> dict[Path, str]:
    """:func:`hash_file` of each; hashing releases the interpreter, so that workers help."""
    paths = list(paths)
    with ThreadPoolExecutor(max(1, workers)) as pool:
        return dict(zip(paths, pool.map(hash_file, paths), strict=True))


def hash_photos(
    folder: Path, files: Iterable[str], *, workers: int = 1, known: Mapping[str, str] = MappingProxyType({})
) -> str:
    """One SHA-256 over the names and hashes of photos, whatever their order; ``known`` hashes are not made again. A
    photo that cannot be read has no hash, and says so."""
    files = sorted(set(files))
    unknown = [folder / name for name in files if name not in known]
    hashes = hash_files(
        [path for path in unknown if path.is_file() and os.access(path, os.R_OK)], workers=workers
    )
    whole = hashlib.sha256()
    for name in files:
        digest = known[name] if name in known else hashes.get(folder / name, "cannot be read")
        whole.update(f"{Path(name).as_posix()} {digest}\n".encode())
    return whole.hexdigest()
