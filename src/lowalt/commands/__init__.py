"""The commands of `lowalt COMMAND`, which call the stages and print what these return."""
