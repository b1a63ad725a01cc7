/* The part of the firmware that knows no hardware: sampling, frames, commands.
 *
 * Byte layout of frames and commands: docs/frames.md. Everything here runs unchanged in the host build, where the
 * functions of hal.h are replaced. No heap, no recursion, no floating point.
 */
#ifndef CORE_H
#define CORE_H

#include <stdbool.h>
#include <stdint.h>

#define FRAME_BYTES 40U
#define SENSOR_COUNT 4U
#define FRAME_SLOTS 32U

/* Name of the array of chips (gfimu list arrays), at most 24 characters. It is sent before each identity, so that the host
 * does not have to be asked how the chips are mounted; empty: the board does not state it. */
#ifndef GFIMU_ARRAY
#define GFIMU_ARRAY ""
#endif

#define FIRMWARE_MAJOR 1U
#define FIRMWARE_MINOR 3U
#define FIRMWARE_PATCH 1U

#define RATE_MIN_HZ 10U
#define RATE_MAX_HZ 3200U
#define RATE_CODE_AUTO 0xFFU

enum frame_type { FRAME_SAMPLE = 1, FRAME_IDENTITY = 2, FRAME_REPLY = 3, FRAME_ARRAY = 4 };

enum command {
    COMMAND_START = 1,
    COMMAND_STOP = 2,
    COMMAND_SET_RATE = 3,
    COMMAND_SET_RANGE = 4,
    COMMAND_SELF_TEST = 5,
    COMMAND_IDENTIFY = 6,
    COMMAND_SET_BAUD = 7
};

enum result {
    RESULT_DONE = 0,
    RESULT_UNKNOWN_COMMAND = 1,
    RESULT_BAD_LENGTH = 2,
    RESULT_BAD_VALUE = 3,
    RESULT_LINE_TOO_SLOW = 4
};

#define STATUS_MISSING(sensor) (1U << (sensor))
#define STATUS_OVERRUN(sensor) (1U << (4U + (sensor)))
#define STATUS_ALL_OVERRUNS (0xFU << 4)
#define STATUS_LATE (1U << 8)
#define STATUS_FRAMES_DROPPED (1U << 9)
#define STATUS_SELF_TEST (1U << 10)
#define STATUS_RECEIVE_ERROR (1U << 11)
#define STATUS_FIRST (1U << 12)
#define STATUS_WATCHDOG_RESET (1U << 13)
#define STATUS_STALE (1U << 14)
#define STATUS_CHIP_FAULT (1U << 15) /* some chip does not hold its configuration; which one: the identity */

/* Reset causes, as the LPC1768 reports them in RSID. */
#define RESET_POWER_ON 1U
#define RESET_EXTERNAL 2U
#define RESET_WATCHDOG 4U
#define RESET_BROWN_OUT 8U
/* Not of RSID, but reported beside them: the crystal did not start, the clock is the internal oscillator's (± 1 %). */
#define RESET_NO_CRYSTAL 16U

/* Take over the defaults, configure the sensors, announce the board. Call with interrupts off. */
void core_init(uint32_t reset_cause, uint32_t baud);

/* Begin sampling at the present rate, anew if it is under way. For the main loop, or with interrupts off. */
void core_start(void);

/* Read all sensors and queue one frame; called by the sample timer's interrupt. */
void core_sample(void);

/* Take one received byte; called by the UART's interrupt. */
void core_receive(uint8_t byte);

/* Remember that the UART lost or damaged a received byte. */
void core_receive_error(void);

/* Carry out received commands and send announcements; called by the main loop. */
void core_poll(void);

/* True while core_poll() has something to do. */
bool core_has_work(void);

/* Bytes ready to send: their address and number (they lie in one piece), then how many of them were taken. */
uint32_t core_transmit_peek(const uint8_t **bytes);
void core_transmit_taken(uint32_t count);

/* Number of samples taken since core_init(): the heartbeat that the watchdog watches. */
uint32_t core_heartbeat(void);

bool core_is_streaming(void);

uint16_t core_crc16(const uint8_t *bytes, uint32_t count);

#endif
