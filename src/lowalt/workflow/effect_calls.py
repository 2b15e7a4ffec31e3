"""The calls for effects that a run prices, looked up by name; they are read only where a rule asks for them."""

from functools import cached_property

from lowalt.common.errors import InputError
from lowalt.scene.catalogue import dotted
from lowalt.workflow.run import Run


class EffectCalls:
    """No effects, each effect alone with its defaults, and scenes."""

    def __init__(self, run: Run) -> None:
        """Keep the run whose effects are priced."""
        self._run = run

    @cached_property
    def all(self) -> dict[str, dict]:
        """{effects, tolerance, snr_db} of every call by its name.

        Raises: InputError where the run has effects itself or a scene is refused.
        """
        # This module costs time to import, and most runs price no effects.
        from lowalt.measure.effects_calls import calls

        return calls(self._run.config, self._run.schema)

    def named(self, name: str) -> dict:
        """Return {effects, tolerance, snr_db} of one call.

        Raises: InputError naming the calls there are.
        """
        if name not in self.all:
            raise InputError(f"results/{self._run.name}/effects: no call {name!r}, expected one of {list(self.all)}")
        return self.all[name]

    def modules(self, name: str) -> list[str]:
        """Return the modules of the effects of one call."""
        return [dotted(effect) for effect in self.named(name)["effects"]]
