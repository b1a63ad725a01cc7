"""The emulated LPC1768 board; needs the extra `firmware` and runs in a process of its own (`board_process`)."""
