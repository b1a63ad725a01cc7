"""The dataset of a campaign: the plan, and one Parquet file per batch whose name is the hash of what it holds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from gfimu.base.errors import InputError
from gfimu.base.files.atomic_file import atomic_path
from sim.trials.sweep.design import Design
from sim.trials.sweep.plan import PlanFile, load_plan

__all__ = ["Dataset"]

_PLAN = "plan.toml"
_MOST_FILES = (
    100_000  # of a folder: making and finding them takes seconds; with many more it takes longer than the runs
)
_FORMAT = 2  # of rows; another one makes other names


@dataclass(frozen=True)
class Dataset:
    """Folder of a campaign.

    Parameters
    ----------
    folder : Path
        The folder.
    plan : PlanFile
        Its plan.
    """

    folder: Path
    plan: PlanFile

    @classmethod
    def create(cls, folder: str | Path, plan: str | Path | PlanFile) -> Self:
        """Open the folder of a plan, or begin it; the plan is a file (.toml) or its content.

        Raises
        ------
        InputError
            If the folder holds another plan, or is a file, or the plan makes more files than a folder should have.
        """
        found, path = plan if isinstance(plan, PlanFile) else load_plan(plan), Path(folder)
        kept = path / _PLAN
        cases = Design(found).points * found.repeats
        if cases > _MOST_FILES * found.batch:
            raise InputError(
                f"{kept if isinstance(plan, PlanFile) else plan}: {cases} cases in batches of {found.batch} are more "
                f"than {_MOST_FILES} files; use a larger batch, or several plans, each with its own seed and folder"
            )
        if kept.exists() and load_plan(kept) != found:
            raise InputError(f"{path}: holds another plan; give another --out")
        if path.is_file():
            raise InputError(f"{path}: is a file; name a folder with --out")
        if path.exists() and not kept.exists() and any(path.iterdir()):
            raise InputError(f"{path}: is not empty and no campaign; give another --out")
        path.mkdir(parents=True, exist_ok=True)
        if not kept.exists():
            with atomic_path(kept) as part:
                if isinstance(plan, PlanFile):
                    table = {key: value for key, value in msgspec.to_builtins(plan).items() if value is not None}
                    part.write_text(tomli_w.dumps(table), encoding="utf-8")
                else:
                    part.write_bytes(Path(plan).read_bytes())
        return cls(path, found)

    @classmethod
    def open(cls, folder: str | Path) -> Self:
        """Open the folder of a campaign; raises `InputError` if it is none."""
        path = Path(folder)
        if not (path / _PLAN).is_file():
            raise InputError(f"{path}: no campaign; gfimu campaign PLAN.toml --out {path} makes one")
        return cls(path, load_plan(path / _PLAN))

    def shard(self, batch: range) -> Path:
        """Return the file of a batch."""
        spec = {"format": _FORMAT, "plan": msgspec.to_builtins(self.plan), "cases": [batch.start, batch.stop]}
        digest = hashlib.sha256(json.dumps(spec, sort_keys=True).encode()).hexdigest()
        return self.folder / f"{batch.start:08d}-{digest[:16]}.parquet"

    def write(self, batch: range, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write the rows of a batch, all or nothing; the same rows give the same bytes."""
        columns: dict[str, list[Any]] = {}
        for row in rows:
            for key in row:
                columns.setdefault(key, [])
        for row in rows:
            for key, values in columns.items():
                values.append(row.get(key))
        with atomic_path(self.shard(batch)) as part:
            pq.write_table(pa.table(columns), part)

    def present(self) -> list[range]:
        """Return the batches whose rows are there, in order; a file that is being written is not there yet."""
        names = {entry.name for entry in self.folder.iterdir()}
        return [batch for batch in Design(self.plan).batches() if self.shard(batch).name in names]

    def table(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the rows that are there, in order, or some of their columns.

        Raises
        ------
        InputError
            If a file is damaged.
        """
        return pa.concat_tables(
            [pa.table({"case": pa.array([], pa.int64())}), *(self._shard(batch, columns) for batch in self.present())],
            promote_options="permissive",
        )

    def _shard(self, batch: range, columns: Sequence[str] | None) -> pa.Table:
        path = self.shard(batch)
        try:
            found = pq.ParquetFile(path)
            wanted = None if columns is None else [name for name in columns if name in found.schema_arrow.names]
            table = found.read(wanted)
        except (pa.ArrowInvalid, OSError) as error:
            reason = str(error).partition("\n")[0]
            raise InputError(f"{path}: damaged ({reason}); delete it and run the campaign again") from None
        if len(table) != len(batch):
            raise InputError(f"{path}: has {len(table)} rows, not {len(batch)}; delete it and run the campaign again")
        return table
