"""The emulated LPC1768 board. Needs the extra `firmware`; runs in a process of its own (`firmware_bridge.board_process`)."""
