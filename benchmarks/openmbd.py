"""The man of OpenMBD in the air, released from rest: `python -m benchmarks.openmbd FOLDER`.

FOLDER is a checkout of GTBiomech/OpenMBD (MIT). A passive body whose joints are within their ranges
falls without any other motion, and keeps its energy and its horizontal momentum. Printed are the
changes of both, beside the time that a step takes.
"""

import sys
from importlib import import_module
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks import tables

STEPS, PRINTED = 600, 100
"""Steps of OpenMBD's own 0.1 ms, and steps between rows."""

HEIGHT = 3.0
"""Height of the pelvis [m]."""


def main() -> None:
    """Print a row for each hundred steps."""
    folder = Path(sys.argv[1])
    sys.path.insert(0, str(folder))
    names = ("models_config", "models_parser", "models_multibody", "physics_rigid_body")
    config_of, parser_of, model_of, body_of = map(import_module, names)
    file = folder / "openmbd_male.json"
    config = config_of.ModelConfig(0)
    config.pos_str = f"0 0 {HEIGHT}"
    segments = parser_of.JSONModelParser(file).bodies
    bodies = [body_of.RigidBody(f"0_{name}", data, 0) for name, data in segments.items()]
    engine = import_module("physics_engine").PhysicsEngine()
    engine.add_model(model_of.MultibodyHumanModel(file), bodies, config)
    engine.recording = False
    gravity, mass = float(np.linalg.norm(engine.gravity)), sum(body.mass for body in bodies)

    def energy() -> float:
        return sum(body.get_kinetic_energy() + body.mass * gravity * body.pos[2] for body in bodies)

    start, rows = energy(), []
    for _ in range(STEPS // PRINTED):
        begin = perf_counter()
        for _ in range(PRINTED):
            engine.step()
        momentum = sum(body.mass * body.vel for body in bodies)
        rows.append(
            {
                "time [s]": round(engine.time, 6),
                "energy gained [J]": float(energy() - start),
                "horizontal speed [m/s]": float(np.hypot(*momentum[:2]) / mass),
                "a step [s]": (perf_counter() - begin) / PRINTED,
            }
        )
    tables.show(rows)


if __name__ == "__main__":
    main()
