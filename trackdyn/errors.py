"""The two ways a run can end without a result, each said in one sentence."""


class TrackdynError(Exception):
    """Base class: its text is one sentence meant for the user."""


class InputError(TrackdynError):
    """Something the user gave cannot be used: the sentence names file, field, value and remedy."""


class DivergenceError(TrackdynError):
    """The integration left the physical range: the sentence names the time and the body."""
