"""The commands of `lowalt COMMAND`. They call the stages and print results; nothing is computed
here.
"""
