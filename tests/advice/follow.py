#!/usr/bin/env python3
"""Follows the advice of `stagger check --advise` on scenes, and prints what it said beside what came of it, as a table.

    python3 tests/advice/follow.py target/release/stagger scenes/deposition.toml … [--set KEY=VALUE]…

Every advice with an edit is followed by itself: the scene is run as it is and with the edit, and each quantity the advice
names is compared. `--costs` instead takes each physics out of the scenes in turn and prints processes, instructions in user
mode (where `perf` is there) and CPU time: medians of five runs.
"""

import json
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

PHYSICS = ["thermal", "optics", "current", "substrate", "acoustics"]
# Of the particles at the start, where no temperature is computed.
START_K = 300.0


def call(program, arguments):
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(arguments)}\n{done.stderr}")
    return json.loads(done.stdout)


def without(text, key):
    """The text without a table, or without a key of an inline table or of [coupling]."""
    header = re.compile(rf"^\[{re.escape(key)}(\.[^\]]*)?\]$")
    lines, inside = [], False
    for line in text.splitlines():
        if line.startswith("["):
            inside = bool(header.match(line.split("#")[0].strip()))
        if not inside:
            lines.append(line)
    name = re.escape(key.split(".")[-1])
    if len(lines) == len(text.splitlines()):
        lines = [re.sub(rf"(,\s*)?\b{name}\s*=\s*[^,}}]+(?=[,}}])", "", line) if "{" in line else line for line in lines]
        lines = [re.sub(r"\{\s*,", "{", line) for line in lines]
    return "\n".join(lines) + "\n"


def edited(text, sets, edits):
    for edit in edits:
        if "set" in edit:
            sets = [*sets, f"{edit['set']['key']}={edit['set']['value']}"]
        else:
            text = without(text, edit["delete"]["key"])
    return text, sets


def flags(sets):
    return [part for value in sets for part in ("--set", value)]


def run(program, scene, text, sets):
    # Beside the scene: files it names stay where they are.
    with tempfile.NamedTemporaryFile("w", dir=scene.parent, suffix=".toml") as file:
        file.write(text)
        file.flush()
        return call(program, ["run", file.name, "--no-record", "--json", *flags(sets)])


def quantity(summary, name):
    fields = {field["field"]: field for field in summary["fields"]}
    if name in ("mean-temperature", "peak-temperature"):
        of = "mean" if name.startswith("mean") else "max"
        return fields["temperature"][of] if "temperature" in fields else START_K
    if name == "mean-position":
        return 3**0.5 * fields["positions"]["mean"]
    if name == "absorbed-energy":
        return summary["ledger"].get("optics", {}).get("lost", {}).get("absorbed", 0.0)
    return max(abs(fields["velocities"]["min"]), abs(fields["velocities"]["max"]))


def follow(program, scenes, sets):
    print("| scene | advice | number | quantity | said, below | came | |\n|---|---|---|---|---|---|---|")
    for scene in scenes:
        text = scene.read_text()
        report = call(program, ["check", str(scene), "--advise", "--json", *flags(sets)])
        before = None
        for advice in report["advice"]:
            if not advice["edits"]:
                continue
            before = before or run(program, scene, text, sets)
            after = run(program, scene, *edited(text, sets, advice["edits"]))
            number = f"{advice['number']} {advice['value']:.3g}" if advice["value"] is not None else advice["number"]
            for effect in advice["effects"] or [None]:
                names = [effect["quantity"]] if effect else ["mean-temperature", "peak-temperature"]
                for name in names:
                    came = abs(quantity(after, name) - quantity(before, name))
                    said = effect and effect["at_most"]
                    verdict = "" if said is None else "holds" if came < said else "FAILS"
                    shown = "-" if said is None else f"{said:.3g}"
                    wall = f"{before['wall_s']:.2f} → {after['wall_s']:.2f} s"
                    print(f"| {scene.stem} | {advice['verdict']} `{advice['about']}` | {number} | {name} | {shown} | {came:.3g} "
                          f"| {verdict} ({wall}) |", flush=True)


def costs(program, scenes, sets):
    print("| scene | without | processes | instructions, 1e6 | CPU, s |\n|---|---|---|---|---|")
    perf = shutil.which("perf")
    for scene in scenes:
        text = scene.read_text()
        named = [name for name in PHYSICS if re.search(rf"^\[{name}\]", text, re.M)]
        variants = [("nothing", text)]
        reduced = text
        for name in reversed(named):
            reduced = without(without(reduced, name), f"coupling.every.{name}")
            for field in {"thermal": ["temperature"], "optics": ["absorbed_power"], "current": ["joule_power"]}.get(name, []):
                reduced = without(reduced, f"coupling.tolerance.{field}")
            variants.append((f"{variants[-1][0]}, {name}".removeprefix("nothing, "), reduced))
        for label, variant in variants:
            with tempfile.NamedTemporaryFile("w", dir=scene.parent, suffix=".toml") as file:
                file.write(variant)
                file.flush()
                command = [program, "run", file.name, "--no-record", "--json", *flags(sets)]
                counts, seconds, nodes = [], [], 0
                for _ in range(5):
                    measured = (["perf", "stat", "-x;", "-e", "instructions:u,task-clock"] if perf else []) + command
                    done = subprocess.run(measured, capture_output=True, text=True, check=True)
                    nodes = len(json.loads(done.stdout)["nodes"])
                    for line in done.stderr.splitlines():
                        part = line.split(";")
                        if len(part) > 2 and part[0].replace(".", "").isdigit():
                            (counts if "instructions" in part[2] else seconds).append(float(part[0]))
                counted = f"{statistics.median(counts) / 1e6:.0f}" if counts else "-"
                cpu = f"{statistics.median(seconds) / 1e3:.3f}" if seconds else "-"
                print(f"| {scene.stem} | {label} | {nodes + 1} | {counted} | {cpu} |", flush=True)


def main():
    program, *rest = sys.argv[1:]
    program = str(pathlib.Path(program).resolve())
    sets, scenes = [], []
    rest = iter(rest)
    measure = follow
    for part in rest:
        if part == "--set":
            sets.append(next(rest))
        elif part == "--costs":
            measure = costs
        else:
            scenes.append(pathlib.Path(part))
    measure(program, scenes, sets)


if __name__ == "__main__":
    main()
