"""[policy]: a function of the user's own that tells joints and thrusters what to do in each frame,
and pushes bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from flowborne.base.errors import PartError
from flowborne.base.phrases import suggestion
from flowborne.base.tables import Table, Text
from flowborne.control.objective_kinds import FUNCTION, Parameters
from flowborne.control.surroundings import Surroundings, with_parameters
from flowborne.scenes.actuators import unknown_actuators
from flowborne.solids.force import Force, immovable


class PolicyTable(Table):
    """[policy]: a function that takes the Simulation and gives commands by name, as a script does.

    It has to depend on the simulation alone, so that a run that goes on from a checkpoint gives the
    same numbers.

    function    "module:name"; the module is one that Python finds, or a file of `plugins`
    joints      those that it tells; motions and controller move the others
    actuators   those of the model that it tells, by Control
    thrusters   those that it tells; the others have the setting of their tables
    bodies      those that it pushes by a Force
    parameters  further arguments of the function, by name
    """

    function: Annotated[str, Field(pattern=FUNCTION)]
    joints: tuple[Text, ...] = ()
    actuators: tuple[Text, ...] = ()
    thrusters: tuple[Text, ...] = ()
    bodies: tuple[Text, ...] = ()
    parameters: Parameters = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not (self.joints or self.actuators or self.thrusters or self.bodies):
            raise ValueError("tells nothing. Name its joints, actuators, thrusters or bodies")
        return self

    def check(self, around: Surroundings, thrusters: Sequence[str]) -> Iterator[str]:
        """Sentences on what cannot be; `thrusters` are the names of the scene's."""
        yield from around.unusable_function(self.function, self.parameters)
        yield from around.unknown_joints(self.joints)
        yield from unknown_actuators(self.actuators, around)
        yield from around.unknown_bodies(self.bodies)
        for body in self.bodies:
            yield from immovable(around.model, body)
        for name in self.thrusters:
            if name not in thrusters:
                end = (
                    suggestion(name, thrusters, "Its thrusters are")
                    if thrusters
                    else (", which has none. Add it as [[thruster]]")
                )
                yield f"thruster '{name}' is not in the scene{end}"

    def build(self) -> Callable[[Any], dict[str, Any]]:
        """Commands in a frame of a simulation; raises PartError if the function fails, or tells
        others."""
        function = with_parameters(self.function, self.parameters)

        def policy(simulation: Any) -> dict[str, Any]:
            with PartError.guarding(f"policy '{self.function}'"):
                commands = dict(function(simulation))
            known = {*self.joints, *self.actuators, *self.thrusters}
            pushed = {f.body for f in commands.values() if isinstance(f, Force)} - {*self.bodies}
            others = {n for n, told in commands.items() if not isinstance(told, Force)} - known
            told = ((others, "joints, actuators or thrusters"), (pushed, "bodies"))
            for names, what in told:
                if names:
                    unnamed = ", ".join(sorted(map(str, names)))
                    raise PartError(
                        f"policy '{self.function}' tells {unnamed}: name it in {what} of [policy]"
                    )
            return commands

        return policy
