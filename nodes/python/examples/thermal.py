"""The temperature of the particles, in Python: takes the place of the built-in thermal node and gives the same bits.

    stagger run scenes/deposition-laser.toml --node thermal="python3 nodes/python/examples/thermal.py"

The models and their sources are those of solver/physics/src/thermal: m C dT/dt = sum G (T_j - T_i) + H through contacts
and walls (Zohdi 2018, eqs. 6.35-6.37), by the trapezoidal rule with weight phi (eqs. 6.44, 10.30).
"""

import numpy as np

from stagger import Node, Port, Reply, Revised, gained, lost, run, stored


class Thermal(Node):
    writes = [Port("temperature", "K", "particles", measure="magnitude")]

    def __init__(self):
        self.settings = self.scene["physics"]["thermal"]
        particles = self.scene["physics"].get("particles", {})
        if particles.get("pours") or particles.get("domain"):
            raise ValueError(
                "this example keeps the particles of its start, but [particles.pour.NAME] or [particles.domain] lets some "
                "come or go: take them out of the scene, or use the built-in thermal physics"
            )
        if self.settings["enthalpy"] is not None:
            raise ValueError(
                "this example knows one material of constant properties that stays solid: take phases, other materials, tables, "
                "the ambient and other solvers out of the scene, or use the built-in thermal physics"
            )
        # A wall without a temperature is insulated: NaN here.
        self.walls_k = np.array([wall["temperature_k"] for wall in self.settings["walls"]], dtype=float)
        self.reads = [Port("radii", "m", "particles")]
        for kind, support in (("contact", "contacts"), ("wall_contact", "wall-contacts")):
            self.reads += [
                Port(f"{kind}_pairs", "1", support, components=2, kind="u32"),
                Port(f"{kind}_area", "m^2", support),
                Port(f"{kind}_distance", "m", support),
            ]
        # Where no laser writes it, it is not among the frozen fields.
        self.reads.append(Port("absorbed_power", "W", "particles", adds_up=True, optional=True))

    def initial(self):
        start_k = np.full(self.settings["count"], self.settings["temperature_k"])
        return start_k, Reply({"temperature": start_k}, ledger=[stored("heat", 0.0)])

    def solve(self, start_k, frozen, window):
        phi, dt_s = self.settings["phi"], window.dt_s
        radii_m = frozen.end["radii"]
        if len(radii_m) != len(start_k):
            raise ValueError(f"field `radii` has {len(radii_m)} rows, but the scene has {len(start_k)} particles")
        masses_kg = self.settings["density_kg_m3"] * 4.0 / 3.0 * np.pi * (radii_m * radii_m * radii_m)
        capacities_j_k = masses_kg * self.settings["heat_capacity_j_kg_k"]
        absorbed_w = frozen.end["absorbed_power"] if "absorbed_power" in frozen.end else np.zeros(len(start_k))
        at_start, at_end = Network(self, frozen.start), Network(self, frozen.end)

        flow_w, start_to_walls_w = at_start.heat_flow(start_k)
        before = self.weight_of_start(start_k, at_start, flow_w, capacities_j_k, dt_s)
        step_factor = None
        if before < 1.0 - phi:
            if self.settings["overshoot"] == "refuse":
                raise ValueError(f"in a step of {dt_s} s particles would leave the temperatures around them")
            if self.settings["overshoot"] == "smaller-step":
                step_factor = 0.99 * (before / (1.0 - phi))
            phi = 1.0 - before
        known_j = dt_s * (before * flow_w + absorbed_w)
        # Each sweep takes a particle's own temperature at its new value (Jacobi), which contracts for every dt.
        contraction = 1.0 + phi * dt_s * at_end.at_particle_w_k / capacities_j_k
        iterate_k = start_k.copy()
        for sweep in range(1, self.settings["iterations"] + 1):
            flow_w, end_to_walls_w = at_end.heat_flow(iterate_k)
            temperatures_k = start_k + (known_j + phi * dt_s * flow_w) / capacities_j_k
            residual_k = temperatures_k - iterate_k
            largest_k = np.max(np.abs(temperatures_k), initial=0.0)
            change = np.max(np.abs(residual_k), initial=0.0) / largest_k if largest_k > 0.0 else 0.0
            if phi == 0.0 or change <= self.settings["tolerance"]:
                break
            iterate_k += residual_k / contraction
        else:
            factor = (self.settings["tolerance"] / change) ** (1.0 / self.settings["iterations"])  # eq. 6.50, p = 1
            step_factor = step_factor or float(np.clip(factor, 0.1, 0.9))

        # The result is the last insertion itself, so that no heat appears or vanishes whatever the tolerance.
        to_walls_j = dt_s * (phi * end_to_walls_w + before * start_to_walls_w)
        ledger = [
            stored("heat", in_order(capacities_j_k * (temperatures_k - self.settings["temperature_k"]))),
            gained("absorbed", in_order(absorbed_w * dt_s)),
            lost("to_walls", to_walls_j),
        ]
        written = Revised(temperatures_k, frozen.end.revision("radii"))
        return temperatures_k, Reply({"temperature": written}, ledger, {"iterations": sweep}, step_factor)

    def weight_of_start(self, start_k, at_start, flow_w, capacities_j_k, dt_s):
        """1 - phi, or less where that would carry a particle beyond all that surrounds it (overshoot.rs)."""
        wanted = 1.0 - self.settings["phi"]
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = capacities_j_k / (dt_s * at_start.at_particle_w_k)
            if np.all(bound >= wanted):
                return wanted
            coldest_k, hottest_k = at_start.surroundings(start_k)
            moved_j = dt_s * flow_w
            until_k = np.where(moved_j > 0.0, hottest_k, coldest_k)
            room = capacities_j_k * (until_k - start_k) / moved_j
        allowed = np.where(np.isfinite(room), np.maximum(room, bound), bound)
        return min(wanted, np.min(allowed[(bound < wanted) & (moved_j != 0.0)], initial=wanted))


class Network:
    """The contacts of one instant: conductances G, in W/K."""

    def __init__(self, node, fields):
        self.count = node.settings["count"]
        self.pairs, self.pairs_w_k = contacts(node, fields, "contact")
        walls, walls_w_k = contacts(node, fields, "wall_contact")
        conducts = ~np.isnan(node.walls_k[walls[:, 1]])
        self.at_wall, self.walls_w_k = walls[conducts, 0], walls_w_k[conducts]
        self.wall_k = node.walls_k[walls[conducts, 1]]
        # One row after the other, as the contacts are listed: floating-point sums depend on their order.
        self.rows = np.concatenate([self.pairs.ravel(), self.at_wall])
        self.at_particle_w_k = self.sum(np.concatenate([np.repeat(self.pairs_w_k, 2), self.walls_w_k]))

    def sum(self, values):
        return np.bincount(self.rows, values, self.count)

    def heat_flow(self, temperatures_k):
        """Heat flowing into each particle, and what flows out to the walls, in W."""
        i, j = self.pairs.T
        flow_w = self.pairs_w_k * (temperatures_k[j] - temperatures_k[i])
        from_walls_w = self.walls_w_k * (self.wall_k - temperatures_k[self.at_wall])
        into_w = np.concatenate([np.stack([flow_w, -flow_w], axis=1).ravel(), from_walls_w])
        return self.sum(into_w), -in_order(from_walls_w)

    def surroundings(self, own_k):
        """The coldest and the hottest that each particle exchanges heat with, itself included, in K."""
        i, j = self.pairs.T
        around = []
        for extreme in (np.minimum, np.maximum):
            met_k = own_k.copy()
            extreme.at(met_k, i, own_k[j])
            extreme.at(met_k, j, own_k[i])
            extreme.at(met_k, self.at_wall, self.wall_k)
            around.append(met_k)
        return around


def contacts(node, fields, kind):
    names = [f"{kind}_{part}" for part in ("pairs", "area", "distance")]
    if len({fields.revision(name) for name in names}) > 1:
        raise ValueError(f"{', '.join(names)} are of different contact lists")
    pairs, area_m2, distance_m = (fields[name] for name in names)
    conductivity = node.settings["conductivity_w_m_k"]
    if node.settings["conductance"] == "constriction":
        half_spaces = 4.0 if kind == "wall_contact" else 2.0  # Holm 1967
        conductance_w_k = half_spaces * conductivity * np.sqrt(np.maximum(area_m2, 0.0) / np.pi)
    else:
        conductance_w_k = conductivity * area_m2 / np.where(area_m2 > 0.0, distance_m, 1.0)  # eq. 6.35
    conducts = area_m2 > 0.0
    return pairs[conducts].astype(np.intp), conductance_w_k[conducts]


def in_order(values):
    return float(np.add.accumulate(values)[-1]) if len(values) else 0.0


if __name__ == "__main__":
    run(Thermal)
