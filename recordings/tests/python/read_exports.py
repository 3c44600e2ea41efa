"""Reads what `stagger export --csv --arrow` wrote, with pyarrow alone, and compares it with itself and with the recording.

    python read_exports.py FILE.mcap FOLDER

Every minimum, mean and maximum of the table of scalars must be that of the Arrow columns at that step, and the last
positions must be those of the recording to the last bit.
"""

import csv
import math
import sys
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.ipc
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def read(path: Path):
    with pyarrow.ipc.open_file(path) as reader:
        return reader.read_all()


def main(recording: str, folder: str) -> int:
    tables = {path.stem: read(path) for path in sorted(Path(folder).glob("*.arrow"))}
    with open(Path(folder) / "scalars.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    steps = [int(row["step"]) for row in rows]
    compared = 0
    for support, table in tables.items():
        units = {field.name: field.metadata[b"unit"].decode() for field in table.schema if b"unit" in (field.metadata or {})}
        for step, row in zip(steps, rows):
            state = table.filter(pc.equal(table["step"], step))
            if state.num_rows:
                assert state["t_s"][0].as_py() == float(row["t_s"]), (support, step)
            for name in table.column_names[3:]:
                unit = f" [{units[name]}]" if units[name] != "1" else ""
                minimum = row.get(f"field {name.replace('.', ' ')}: min{unit}")
                if not minimum or state[name].null_count or not state.num_rows:
                    continue
                values = state[name]
                assert pc.min(values).as_py() == float(minimum), (name, step)
                assert pc.max(values).as_py() == float(row[f"field {name.replace('.', ' ')}: max{unit}"]), (name, step)
                # Summed in another order.
                mean = float(row[f"field {name.replace('.', ' ')}: mean{unit}"])
                assert math.isclose(pc.mean(values).as_py(), mean, rel_tol=1e-9, abs_tol=1e-12 * abs(pc.max(pc.abs(values)).as_py())), (name, step)
                compared += 1
    with open(recording, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        positions = [
            list(message.f64) for *_, message in reader.iter_decoded_messages(topics=["field/particles/positions"]) if message.f64
        ][-1]
    particles = tables["particles"]
    last = particles.filter(pc.equal(particles["step"], max(steps)))
    for axis, name in enumerate(("positions.x", "positions.y", "positions.z")):
        assert last[name].to_pylist() == positions[axis::3], name
    print(f"{len(steps)} states, {compared} columns compared, {', '.join(f'{name}: {table.num_rows} rows' for name, table in tables.items())}")
    return 0 if compared > 10 * len(steps) else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
