"""[policy]: a function of the user's own that tells joints what to do in each frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from flowborne.base.errors import PartError
from flowborne.base.tables import Table, Text
from flowborne.control.objective_kinds import FUNCTION, Parameters
from flowborne.control.surroundings import Surroundings, with_parameters
from flowborne.scenes.actuators import unknown_actuators


class PolicyTable(Table):
    """[policy]: a function that takes the Simulation and gives commands to joints by name.

    It has to depend on the simulation alone, so that a run that goes on from a checkpoint gives the
    same numbers.

    function    "module:name"; the module is one that Python finds, or a file of `plugins`
    joints      those that it tells; motions and controller move the others
    actuators   those of the model that it tells, by Control
    parameters  further arguments of the function, by name
    """

    function: Annotated[str, Field(pattern=FUNCTION)]
    joints: tuple[Text, ...] = ()
    actuators: tuple[Text, ...] = ()
    parameters: Parameters = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not (self.joints or self.actuators):
            raise ValueError("tells nothing. Name its joints or actuators")
        return self

    def check(self, around: Surroundings) -> Iterator[str]:
        """Sentences on what cannot be."""
        yield from around.unusable_function(self.function, self.parameters)
        yield from around.unknown_joints(self.joints)
        yield from unknown_actuators(self.actuators, around)

    def build(self) -> Callable[[Any], dict[str, Any]]:
        """Commands in a frame of a simulation; raises PartError if the function fails, or tells
        other joints."""
        function = with_parameters(self.function, self.parameters)

        def policy(simulation: Any) -> dict[str, Any]:
            with PartError.guarding(f"policy '{self.function}'"):
                commands = dict(function(simulation))
            others = sorted(set(commands) - {*self.joints, *self.actuators})
            if others:
                raise PartError(
                    f"policy '{self.function}' tells {', '.join(others)}: name it in joints or "
                    "actuators of [policy]"
                )
            return commands

        return policy
