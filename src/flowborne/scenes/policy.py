"""[policy]: a function of the user's own that tells joints what to do in each frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any

from pydantic import Field

from flowborne.base.errors import PartError
from flowborne.base.tables import Table, Text
from flowborne.control.objective_kinds import FUNCTION, Parameters
from flowborne.control.surroundings import Surroundings, with_parameters


class PolicyTable(Table):
    """[policy]: a function that takes the Simulation and gives commands to joints by name.

    It has to depend on the simulation alone, so that a run that goes on from a checkpoint gives the
    same numbers.

    function    "module:name"; the module is one that Python finds, or a file of `plugins`
    joints      those that it tells; motions and controller move the others
    parameters  further arguments of the function, by name
    """

    function: Annotated[str, Field(pattern=FUNCTION)]
    joints: Annotated[tuple[Text, ...], Field(min_length=1)]
    parameters: Parameters = Field(default_factory=dict)

    def check(self, around: Surroundings) -> Iterator[str]:
        """Sentences on what cannot be."""
        yield from around.unusable_function(self.function, self.parameters)
        yield from around.unknown_joints(self.joints)

    def build(self) -> Callable[[Any], dict[str, Any]]:
        """Commands in a frame of a simulation; raises PartError if the function fails, or tells
        other joints."""
        function = with_parameters(self.function, self.parameters)

        def policy(simulation: Any) -> dict[str, Any]:
            with PartError.guarding(f"policy '{self.function}'"):
                commands = dict(function(simulation))
            others = sorted(set(commands) - set(self.joints))
            if others:
                raise PartError(
                    f"policy '{self.function}' tells {', '.join(others)}: name it in joints of "
                    "[policy]"
                )
            return commands

        return policy
