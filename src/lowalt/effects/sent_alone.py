"""Whether a look's tones are those of the target's echo on the direct path and of nothing else."""

from lowalt.effects.catalogue import providing
from lowalt.effects.chain import Chain
from lowalt.effects.interface import AddsEchoes, AddsNoise, AddsSignals, AddsTargets, ChangesResponse


def send(chain: Chain) -> None:
    """Have the target's echo made as tones at once, where the receiver begins with them and nothing else is sent.

    The pass that makes them also finds the echo's strongest cells, to which noise levels refer.
    """
    first = chain.receiver[:1]
    others = [*providing(chain.channel, AddsEchoes), *providing(chain.channel, AddsSignals)]
    others += providing(chain.channel, AddsTargets)
    before = [*providing(first, AddsNoise), *providing(first, ChangesResponse)]
    drawn = chain.sending.source is not None or chain.sending.distorts
    if first and not (before or others or drawn or chain.target.bent):
        chain.target.send()
