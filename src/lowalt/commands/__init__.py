"""Commands for people: `lowalt COMMAND`. They call the stages and print; nothing is computed here."""
