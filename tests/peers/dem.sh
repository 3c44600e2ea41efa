#!/bin/sh
# Our side of the benchmark beside LAMMPS and LIGGGHTS: dem.sh FILE WIDTH HEIGHT STEPS THREADS [heat].
# Builds the release binary once; see solver/scene/examples/settled_bed.rs for the problem.
set -eu
cd "$(dirname "$0")/../.."
binary=target/release/examples/settled_bed
[ -x "$binary" ] || cargo build --release --quiet -p stagger-scene --example settled_bed >&2
exec "$binary" "$@"
