"""Files of the hair that the page gives, written when they are asked for."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from pathlib import Path

from hairkit.studio.studio import BUILD_S, EXPORT_S, Studio


async def made_file(studio: Studio, format_: str, path: Path) -> Path:
    """Return the file of the groom in a format, an archive where that is several files."""
    groom, several = studio.project.groom, path.with_name(f"{path.name}.zip")
    for file in (path, several):
        if file.is_file() and file.stat().st_mtime_ns >= groom.stat().st_mtime_ns:
            return file
    with tempfile.TemporaryDirectory(dir=studio.project.incoming) as folder:
        made = Path(folder, "files", path.name)
        made.parent.mkdir()
        values = {"groom": str(groom), "format": format_, "path": str(made)}
        await studio.builder.call("export", EXPORT_S + BUILD_S, values)
        if sum(file.is_file() for file in made.parent.iterdir()) == 1:
            return made.replace(path)
        archive = await asyncio.to_thread(
            shutil.make_archive, str(Path(folder, "several")), "zip", made.parent
        )
        return Path(archive).replace(several)
