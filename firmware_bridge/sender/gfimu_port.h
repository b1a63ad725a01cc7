/* What a board has to offer so that it sends the frames of gfimu: nine functions to fill in, and two to call.
 *
 * sender.c and the firmware's core call these functions from one thread, never from an interrupt. None may wait for longer
 * than a tenth of the sample period; a port may use interrupts and DMA of its own behind them. Examples: ports/.
 */
#ifndef GFIMU_PORT_H
#define GFIMU_PORT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Chips that are wired, 1 to 4. The others are reported as missing, without an access to the bus. */
#ifndef GFIMU_CHIPS
#define GFIMU_CHIPS 4
#endif

#define GFIMU_NOTHING (-1)
#define GFIMU_DAMAGED (-2)

/* Why the board started: the bits of the identity (docs/reference/frames.md). */
#define GFIMU_RESET_POWER_ON 1U
#define GFIMU_RESET_EXTERNAL 2U
#define GFIMU_RESET_WATCHDOG 4U
#define GFIMU_RESET_BROWN_OUT 8U
#define GFIMU_RESET_NO_CRYSTAL 16U

/* ---- to fill in ---- */

/* Pull the chip select of chip 0…3 low, exchange bytes (at most 16) in place, and let it high again: SPI mode 3, most
 * significant bit first, at most 5 MHz. 150 ns have to pass before the same chip is selected again. Bytes that can't be
 * exchanged in time become 0xFF. At 3200 samples per second four exchanges of 10 bytes have 250 µs together. */
void gfimu_port_exchange(uint8_t chip, uint8_t *bytes, uint8_t count);

/* SPI clock, kHz; for the identity. */
uint32_t gfimu_port_spi_khz(void);

/* Only where GFIMU_TEMPERATURE is defined, here or with -D: temperature of the board or of a chip on it, 0.01 °C, as last
 * read; INT16_MIN while there is none. Called once per sample. */
#ifdef GFIMU_TEMPERATURE
int16_t gfimu_port_temperature(void);
#endif

/* Time in µs from a crystal, all 32 bits, from any start: it wraps after 71.6 min. It stamps the samples. */
uint32_t gfimu_port_time_us(void);

/* Send what can be sent without waiting; returns how many of the bytes were taken. */
uint32_t gfimu_port_write(const uint8_t *bytes, uint32_t count);

/* Whether every byte taken has left the line; true if gfimu_port_set_baud waits for that itself. */
bool gfimu_port_write_idle(void);

/* The next byte received, 0…255; GFIMU_NOTHING without waiting; GFIMU_DAMAGED once for bytes that were lost or came with a
 * framing error. A command has up to 14 bytes: what comes within a sample has to find room. */
int16_t gfimu_port_read(void);

/* Whether the line can have a speed within 1 %; true where it has none, as over USB. */
bool gfimu_port_baud_possible(uint32_t baud);

/* Change the speed of the line. */
void gfimu_port_set_baud(uint32_t baud);

/* Called while all is well, at least ten times a second: the place to feed a watchdog of 0.5 s or more. `light` blinks, once
 * a second, twice while samples are taken; an LED can show it. May be empty. */
void gfimu_port_alive(bool light);

/* ---- to call ---- */

/* Once, when the hardware is ready: sets up the chips, announces the board and starts sampling at 100 Hz. `baud`: the speed
 * of the line now. */
void gfimu_sender_begin(uint32_t reset_cause, uint32_t baud);

/* Again and again: takes a sample when its time has come, carries out commands, moves bytes. How soon it is called after a
 * sample's time is the jitter of the sampling; the time stamp has it. */
void gfimu_sender_step(void);

#ifdef __cplusplus
}
#endif

#endif
