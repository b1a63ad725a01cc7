"""A twin without a wider library: what the usual effects can't explain ends as unknown, with its description."""

from sim.twin import Twin


class UsualTwin(Twin):
    """A twin that searches the usual effects only."""

    def searching(self, *, wide):
        return self
