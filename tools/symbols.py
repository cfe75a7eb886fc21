"""The one alphabet of the method: a table in docs/method/index.md, to which formulas are linked."""

from __future__ import annotations

import re
from typing import NamedTuple

from markdown_text import table


class Symbol(NamedTuple):
    """A letter of the method's formulas.

    latex    as it stands in formulas
    meaning  in words
    unit     SI; "" for an operator
    chapter  page of docs/method that explains it; "" for what all of them use
    """

    latex: str
    meaning: str
    unit: str
    chapter: str = ""


SYMBOLS = (
    Symbol("h", "edge of a cell", "m", "fluid"),
    Symbol(r"S_f", "area of a face of a cell, $h^2$", "m²", "cut-cells"),
    Symbol("S", "area of a mouth, of a disc or of a face of a body", "m²", "mouths"),
    Symbol(r"a_f", "open part of a face", "1", "cut-cells"),
    Symbol(r"V_c", "open volume of a cell", "m³", "cut-cells"),
    Symbol(r"\alpha", "open part of a cell", "1", "viscosity"),
    Symbol(r"V_f", "control volume of a face", "m³", "fluid"),
    Symbol(r"M_f", "volume that moves with a face", "m³", "fluid"),
    Symbol(r"m_f", "its mass", "kg", "cut-cells"),
    Symbol("M", "masses of all faces, a diagonal matrix", "kg", "coupled-solve"),
    Symbol("x", "position in space", "m"),
    Symbol("n", "unit vector normal to a surface, outwards", "1"),
    Symbol("r", "distance from a middle", "m"),
    Symbol("s", "distance to a stop, or along a direction", "m"),
    Symbol("l", "length of an actuator, or of a column of fluid", "m"),
    Symbol("d", "unit vector of a direction that the scene gives", "1"),
    Symbol("u", "velocity of the fluid, on the faces", "m/s", "fluid"),
    Symbol(r"u_b", "velocity of a body at a point", "m/s", "cut-cells"),
    Symbol(r"\delta u", "change or difference of velocities", "m/s", "step"),
    Symbol("p", "pressure in the cells", "Pa", "fluid"),
    Symbol(r"\hat p", r"its impulse, $p\,\Delta t$", "Pa s", "coupled-solve"),
    Symbol(r"\delta \hat p", "difference of it between two cells", "Pa s", "cut-cells"),
    Symbol(r"\delta p", "change of pressure from one sweep to the next", "Pa", "viscosity"),
    Symbol(r"\rho", "density of the fluid", "kg/m³"),
    Symbol("g", "gravity", "m/s²"),
    Symbol("t", "time", "s"),
    Symbol(r"\mu", "viscosity of the fluid", "Pa s", "viscosity"),
    Symbol(r"\nu", r"kinematic viscosity, $\mu / \rho$", "m²/s", "viscosity"),
    Symbol("Q", "rate of volume of a source or a mouth", "m³/s", "mouths"),
    Symbol(r"Q_f", "flux of volume through a face", "m³/s", "leak-proof"),
    Symbol(r"\phi", "dye or smoke", "1", "fluid"),
    Symbol(r"\psi", "stream function, vector potential", "m²/s", "fluid"),
    Symbol(r"\Gamma", "circulation around an edge", "m²/s", "fluid"),
    Symbol("U", "velocity of the sea", "m/s", "fluid"),
    Symbol("N", "number of dimensions", "1", "fluid"),
    Symbol(r"\kappa", "wavenumber", "1/m", "fluid"),
    Symbol("D", "net outflow of a cell through its open faces", "", "coupled-solve"),
    Symbol("G", "gradient between cells", "", "coupled-solve"),
    Symbol("K", r"weighted Laplacian, $-D M^{-1} G$", "", "coupled-solve"),
    Symbol("J", "from $v$ to the volume that bodies take from a cell in a second", "", "cut-cells"),
    Symbol("J^T", "from pressure to generalised force", "", "cut-cells"),
    Symbol("Z", "a V-cycle, about the inverse of $K$", "", "coupled-solve"),
    Symbol("X", r"a root, $X X^T = J A^{-1} J^T$", "", "coupled-solve"),
    Symbol("Y", "an inverse times rows, computed once", "", "coupled-solve"),
    Symbol("L", "weights of the viscous links between faces", "kg/s", "viscosity"),
    Symbol("W", "weights of the links of faces to walls or sides", "kg/s; 1", "viscosity"),
    Symbol("w", "a weight", ""),
    Symbol(r"\eta", "open part of a line beside a corner", "1", "viscosity"),
    Symbol(r"\beta", "distance of that line from a face, in cells", "1", "viscosity"),
    Symbol(r"\varepsilon", "part by which volumes are scaled", "1", "leak-proof"),
    Symbol("q", "positions of the joints", "m, rad", "bodies"),
    Symbol(r"\delta q", "displacement of a trial", "m, rad", "control"),
    Symbol(r"\Delta q", "step of the controller", "m, rad", "control"),
    Symbol("v", "velocities of the joints", "m/s, rad/s", "bodies"),
    Symbol(r"\dot v", "their acceleration", "m/s², rad/s²", "contact"),
    Symbol(r"\theta", "angle of a joint", "rad", "bodies"),
    Symbol(r"\omega", "angular velocity", "rad/s"),
    Symbol("A", "matrix of the bodies with springs, contact and flesh", "kg, kg m²", "bodies"),
    Symbol(r"A^{-1}", "what an impulse does to the bodies", "", "coupled-solve"),
    Symbol(r"A_u", "the same with the fluid that bodies drag", "", "viscosity"),
    Symbol(r"M_b", "mass matrix of the bodies", "kg, kg m²", "bodies"),
    Symbol(r"K_b", "their stiffness", "N/m, N m", "bodies"),
    Symbol(r"C_b", "their damping", "N s/m, N m s", "bodies"),
    Symbol(r"C_\omega", "couple of viscosity on bodies that turn", "N m s", "viscosity"),
    Symbol(r"V_b", "volume of a body", "m³", "viscosity"),
    Symbol("B", "from $v$ to the velocity of the points of walls", "", "viscosity"),
    Symbol(r"J_a", "active rows of contacts and limits", "", "bodies"),
    Symbol(r"K_a", "their stiffness", "N/m, N m", "contact"),
    Symbol("f", "generalised force on the bodies", "N, N m", "bodies"),
    Symbol("F", "force on one body, or of one actuator", "N, N m", "bodies"),
    Symbol(r"\tau", "torque of a drive", "N, N m", "bodies"),
    Symbol("T", "thrust", "N", "thrusters"),
    Symbol("R", "radius of a disc", "m", "thrusters"),
    Symbol("O", "objective", "", "control"),
    Symbol(r"\ell", "strength of a joint", "m, rad", "control"),
    Symbol("E", "Young's modulus", "Pa", "flesh"),
    Symbol(r"\nu_E", "Poisson's ratio", "1", "flesh"),
    Symbol(r"\mu_E", "Lamé's second constant", "Pa", "flesh"),
    Symbol(r"\lambda_E", "Lamé's first constant", "Pa", "flesh"),
)

TIME = re.compile(r"\^(?:[n*+]|\{n[^}]*\})$")
"""Superscript that says when in a step."""

PAGE = "method/index"
"""Page of the table."""


def anchor(symbol: Symbol) -> str:
    """The name of its row in the table."""
    return f"symbol-{SYMBOLS.index(symbol)}"


def page() -> str:
    """The table."""
    rows = [
        [
            f'<span id="{anchor(one)}"></span>${one.latex}$',
            one.meaning,
            one.unit,
            f"[]({one.chapter}.md)" if one.chapter else "",
        ]
        for one in SYMBOLS
    ]
    return table(("symbol", "meaning", "unit", "chapter"), rows)


def symbol_of(latex: str) -> Symbol | None:
    """The symbol that a formula is, at any time of the step; None if it is more or unknown."""
    letter = TIME.sub("", latex.strip())
    return next((one for one in SYMBOLS if one.latex == letter), None)
