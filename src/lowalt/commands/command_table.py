"""All commands of `lowalt` by name: the core's, then those of the extensions that are installed."""

from lowalt.config.core_commands import CORE_COMMANDS, Command
from lowalt.config.extensions import offered

COMMANDS: dict[str, Command] = CORE_COMMANDS | offered("commands")
