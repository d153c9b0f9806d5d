"""What groups of an identification have in common."""

from omnidyn.identification.identification import Identification


def shared(found: Identification) -> set[str]:
    """Names of the numbers that all groups share: those of which there is no difference between two groups."""
    return {name for fit in found.groups.values() for name in fit.value} - {d.key for d in found.differences}
