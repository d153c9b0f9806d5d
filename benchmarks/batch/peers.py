"""Others on the work of a batch: a C++ loop compiled here, NumPy, JAX, MuJoCo. What is not installed is left out."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.simulation.batch.exact import BREAKAWAY, COULOMB, PER_VOLT, PHI, RATE

SOURCE = Path(__file__).parent / "loop.cpp"
FLAGS = (
    "-std=c++17 -O3 -march=native -mprefer-vector-width=512 -ffast-math -fno-finite-math-only -fno-associative-math "
    "-fsigned-zeros -fPIC -shared"
)
XML = """<mujoco><option timestep="{dt}" gravity="0 0 0" integrator="implicitfast"><flag contact="disable"/></option>
<worldbody>
<body><joint name="x" type="slide" axis="1 0 0" damping="{b[0]}" frictionloss="{c[0]}"/>
<geom type="sphere" size=".1" mass="1"/></body>
<body><joint name="y" type="slide" axis="0 1 0" damping="{b[1]}" frictionloss="{c[1]}"/>
<geom type="sphere" size=".1" mass="1"/></body>
<body><joint name="w" type="hinge" axis="0 0 1" damping="{b[2]}" frictionloss="{c[2]}"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
</worldbody><actuator><motor joint="x"/><motor joint="y"/><motor joint="w"/></actuator></mujoco>"""


def cpp(folder: Path, fused: bool, march: str = "native") -> Any:
    """The library of loop.cpp, compiled into a folder; None where there is no g++. fused: multiply and add in one.

    march: the processor that it is compiled for.
    """
    if shutil.which("g++") is None:
        return None
    library = folder / f"libloop{fused:d}.so"
    flags = [*FLAGS.replace("native", march).split(), f"-ffp-contract={'fast' if fused else 'off'}"]
    subprocess.run(["g++", *flags, "-o", str(library), str(SOURCE)], check=True)
    loaded = ctypes.CDLL(str(library))
    loaded.multiply_adds.restype = loaded.divisions.restype = ctypes.c_double
    return loaded


def cpp_run(library: Any, laws: np.ndarray, volts: np.ndarray, dtype: Any) -> Callable[[], np.ndarray]:
    """A call of the loop that returns the last speeds, shape (3, n)."""
    laws, volts = np.ascontiguousarray(laws, dtype), np.ascontiguousarray(volts, dtype)
    out = np.zeros((3, laws.shape[1]), dtype)
    function = library.run64 if dtype == np.float64 else library.run32
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (laws, volts, out)]

    def run() -> np.ndarray:
        function(ctypes.c_long(len(volts)), ctypes.c_long(laws.shape[1]), *pointers)
        return out

    return run


def drives(laws: np.ndarray) -> np.ndarray:
    """Acceleration per volt, shape (3, wheels, n)."""
    return laws[PER_VOLT:].reshape(3, -1, laws.shape[1])


def numpy_run(laws: np.ndarray, volts: np.ndarray) -> Callable[[], np.ndarray]:
    """The same law on whole arrays, robots along the last axis."""
    c, s, a, phi = (laws[first : first + 3] for first in (COULOMB, BREAKAWAY, RATE, PHI))
    gain = drives(laws)

    def run() -> np.ndarray:
        v = np.zeros_like(c)
        with np.errstate(divide="ignore", invalid="ignore"):
            for row in volts:
                g = gain[:, 0] * row[0] + gain[:, 1] * row[1] + gain[:, 2] * row[2]
                sign = np.where(v != 0.0, np.sign(v), np.sign(g))
                x, q = sign * v, sign * g
                slid = x + phi * (q - c - a * x)
                back = np.where(q < -s, (q + c) * (phi - (x - phi * a * x) / (c - q)), 0.0)
                moved = np.where((slid >= 0.0) | (q >= c), slid, back)
                v = np.where((x == 0.0) & (q <= s), 0.0, sign * moved)
        return v

    return run


def jax_run(laws: np.ndarray, volts: np.ndarray) -> Callable[[], np.ndarray] | None:
    """The same by JAX: a scan over the rows, in double precision."""
    if find_spec("jax") is None:
        return None
    import jax  # pyright: ignore[reportMissingImports]
    import jax.numpy as jnp  # pyright: ignore[reportMissingImports]

    jax.config.update("jax_enable_x64", True)
    c, s, a, phi = (jnp.asarray(laws[first : first + 3]) for first in (COULOMB, BREAKAWAY, RATE, PHI))
    gain, rows = jnp.asarray(drives(laws)), jnp.asarray(volts)

    def step(v: Any, row: Any) -> Any:
        g = gain[:, 0] * row[0] + gain[:, 1] * row[1] + gain[:, 2] * row[2]
        sign = jnp.where((v < 0.0) | ((v == 0.0) & (g < 0.0)), -1.0, 1.0)
        x, q = sign * v, sign * g
        slid = x + phi * (q - c - a * x)
        crosses = (slid < 0.0) & (q < c)
        back = (q + c) * (phi - (x - phi * a * x) / jnp.where(crosses, c - q, 1.0))
        moved = jnp.where(crosses, jnp.where(q < -s, back, 0.0), slid)
        return jnp.where((x == 0.0) & (q <= s), 0.0, sign * moved), None

    final = jax.jit(lambda: jax.lax.scan(step, jnp.zeros_like(c), rows)[0])
    return lambda: np.asarray(final())


def mujoco_run(laws: np.ndarray, volts: np.ndarray, dt: float) -> Callable[[], np.ndarray] | None:
    """`mujoco.rollout`, a model for each robot: three free joints of mass 1, damping, frictionloss; one thread."""
    if find_spec("mujoco") is None:
        return None
    import mujoco
    from mujoco import rollout

    models = [
        mujoco.MjModel.from_xml_string(XML.format(dt=dt, b=laws[RATE : RATE + 3, k], c=laws[COULOMB : COULOMB + 3, k]))
        for k in range(laws.shape[1])
    ]
    forces = np.einsum("tw,awn->nta", volts, drives(laws))
    data = [mujoco.MjData(models[0])]
    start = np.zeros((len(models), mujoco.mj_stateSize(models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    return lambda: rollout.rollout(models, data, start, forces)[0][:, -1, -3:].T


def mjx_run(laws: np.ndarray, volts: np.ndarray, dt: float) -> Callable[[], np.ndarray] | None:
    """The same models in MJX, on what JAX finds."""
    if find_spec("mujoco.mjx") is None if find_spec("mujoco") else True:
        return None
    import jax  # pyright: ignore[reportMissingImports]
    import mujoco
    from mujoco import mjx  # pyright: ignore[reportMissingImports,reportAttributeAccessIssue]

    text = XML.replace("implicitfast", "Euler").format(
        dt=dt, b=laws[RATE : RATE + 3, 0], c=laws[COULOMB : COULOMB + 3, 0]
    )
    model = mjx.put_model(mujoco.MjModel.from_xml_string(text))
    forces = np.einsum("tw,awn->tna", volts, drives(laws))
    start = mjx.make_data(model)

    def steps(control: Any) -> Any:
        def step(data: Any, force: Any) -> Any:
            return mjx.step(model, data.replace(ctrl=force)), None

        return jax.lax.scan(step, start, control)[0].qvel

    final = jax.jit(jax.vmap(steps, in_axes=1))
    return lambda: np.asarray(final(forces)).T
