"""The recursion under the monitor of channels: blocks, their noise, the filter with the signatures of faults."""
