"""The program itself: its commands, and that calling it leaves nothing behind."""

from gfimu.cli.app import COMMAND_FILES, program


def test_a_second_call_finds_the_program_as_the_first_did(gfimu_command):
    first = gfimu_command("--help").stdout
    assert len(program().registered_commands) == len(program().registered_commands)
    assert gfimu_command("--help").stdout == first
    assert set(COMMAND_FILES) <= set(first.split())
