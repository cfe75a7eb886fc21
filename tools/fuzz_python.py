"""Broken parts of one's own: Python that raises, returns or prints what no part should."""

from __future__ import annotations

import random

from fuzz_bases import ARM, PENDULUM, Broken
from fuzz_changes import torn, words

NOISE = "noise of a part"
"""How lines begin that a part of ours prints itself."""

STATEMENTS = (
    *(
        "raise SystemExit",
        "raise SystemExit(0)",
        "raise SystemExit('x')",
        "import sys; sys.exit(3)",
    ),
    *(
        "raise BaseException('x')",
        "raise GeneratorExit",
        "raise StopIteration",
        "raise MemoryError",
    ),
    *(
        "raise Odd",
        "raise Mute",
        "raise ValueError('a\\nb\\x1b[2J')",
        "raise ValueError('a' * 9999)",
    ),
    *("raise OSError(28, 'No space left on device')", "raise KeyError", "raise Exception"),
    *("raise UnicodeDecodeError('utf-8', b'', 0, 1, 'x')", "raise RecursionError", "assert False"),
    *(
        "import flowborne; raise flowborne.SceneError('x')",
        "raise BrokenPipeError",
        "return deep()",
    ),
    f"os.write(1, b'{NOISE} \\xff\\n')",
    f"os.write(2, b'{NOISE} \\xff\\n'); raise ValueError",
    f"print('{NOISE}')",
    "import warnings; warnings.warn('x')",
    *("del np", "1 / 0", "np.ones(3) @ np.ones(4)", "np.ones(3)[9]", "return self.nothing", "pass"),
    *("x = np.linalg.inv(np.zeros((2, 2)))", "import no_such_module_of_anybody", "return await_"),
)
"""What a function does instead, or before."""

VALUES = (
    *("None", "'x'", "b'x'", "float('nan')", "float('inf')", "-1e308", "10 ** 400", "1j", "True"),
    *("[]", "{}", "[[1], [2, 3]]", "object()", "(lambda: 0)", "np.zeros((2, 2))", "np.zeros(7)"),
    *(
        "np.full(3, np.nan)",
        "np.array(['x'])",
        "np.array([None])",
        "np.float32(1)",
        "-1",
        "0",
        "''",
    ),
    *("np.zeros((0, 3))", "np.ma.masked", "(n for n in range(3))", "np.zeros(3, complex)", "type"),
    *("np.array(1)", "np.array([1])", "np.full(1, 1e308)", "'1'", "Exception('x')", "range(3)"),
)
"""What a function returns instead."""

MODULE = """
import os
import numpy as np
from dataclasses import dataclass
from flowborne import parts

class Odd(BaseException): pass
class Mute(Exception):
    def __str__(self): raise ValueError
def deep(): return deep()

@parts.objective("wish_{name}")
@dataclass(frozen=True)
class Wish:
    height: float = 0.0
    def value(self, measured):
        return abs(measured.body("arm").centre[2] - self.height)  # value

@parts.rule("rule_{name}")
@dataclass(frozen=True)
class Rule:
    part: float = 0.5
    def step_scale(self, scale, before, gradient):
        return np.ones_like(scale)  # step_scale
    def step(self, poses, gradient, limit):
        return self.part * parts.descent(gradient, limit)  # step

@parts.gradient("gradient_{name}")
@dataclass(frozen=True)
class Slope(parts.FiniteDifference):
    def estimate(self, poses):
        return parts.Estimate(0.0, np.ones(poses.count))  # estimate

@parts.exporter(".{name}")
@dataclass(frozen=True)
class Track:
    body: str = "arm"
    def write(self, run, path):
        return np.savetxt(path, run.every("body_position")[:, 0])  # write

def wish(measured, share):
    return share * measured.joint("hinge").position[0]  # wish
def blow(x, time):
    return np.ones_like(x)  # blow

pass  # import
"""

SCENE = """
[[wind]]
kind = "python"
function = "{name}:blow"
[[objectives]]
kind = "wish_{name}"
height = 1.0
[[objectives]]
kind = "python"
function = "{name}:wish"
parameters = {{ share = 0.5 }}
[controller]
rule = {{ kind = "rule_{name}" }}
gradient = {{ kind = "gradient_{name}", resolution = 1e-9 }}
"""

SHAPE = """
import os
import numpy as np
from dataclasses import dataclass
from flowborne import parts

class Odd(BaseException): pass
class Mute(Exception):
    def __str__(self): raise ValueError
def deep(): return deep()

@parts.shape("shape_{name}")
@dataclass(frozen=True)
class Ball:
    radius: float
    def distance(self, points):
        return np.linalg.norm(points, axis=1) - self.radius  # distance
    def half_extents(self):
        return [self.radius, self.radius, self.radius]  # half_extents

pass  # import
"""

TANK = """
plugins = ["{name}.py"]
[time]
frames = 3
[domain]
size = [2.0, 2.0, 2.0]
resolution = 8
[fluid]
density = 1000.0
[solids]
model = "model.xml"
[[shapes]]
kind = "shape_{name}"
body = "ball"
radius = 0.4
density = 1200.0
"""

FLOATING = (
    '<mujoco><worldbody><body name="ball" pos="1 1 1"><freejoint/></body></worldbody></mujoco>'
)


def part(rng: random.Random) -> Broken:
    """One function of a scene's own parts does, or returns, what it should not."""
    name = f"part_{rng.getrandbits(48):x}"
    shape = rng.random() < 0.2
    code = (SHAPE if shape else MODULE).replace("{name}", name)
    lines = code.splitlines()
    number = rng.choice([n for n, line in enumerate(lines) if "  # " in line])
    indent = lines[number][: -len(lines[number].lstrip())]
    kind = rng.random()
    if kind < 0.45:
        lines.insert(number, indent + rng.choice(STATEMENTS))
    elif kind < 0.85:
        lines[number] = f"{indent}return {rng.choice(VALUES)}"
    content = "\n".join(lines).encode()
    if kind >= 0.85:
        content = rng.choice((words, torn))(rng, content)
    if shape:
        scene = TANK.format(name=name)
        return Broken(
            {"scene.toml": scene.encode(), "model.xml": FLOATING.encode(), f"{name}.py": content}
        )
    scene = f'plugins = ["{name}.py"]\n' + PENDULUM + SCENE.format(name=name)
    scene = scene.replace("[output]", f'[output]\nexports = ["track.{name}"]')
    return Broken({"scene.toml": scene.encode(), "model.xml": ARM.encode(), f"{name}.py": content})
