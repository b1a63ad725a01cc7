/* What the core needs from the hardware. board.c implements it on the LPC1768, hal_host.c in the host build. */
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

/* What a sample as a rule does not pass through: kept out of the way of what it does. */
#define SELDOM __attribute__((cold, noinline))

/* Select one sensor, exchange 16-bit words (at most 8) in place, deselect it. All words are 0xFFFF if the interface does
 * not get done with them. */
void hal_spi_exchange(uint32_t sensor, uint16_t *words, uint32_t count);

/* The same for HAL_BURST_WORDS words, the longest loop of a sample. */
#define HAL_BURST_WORDS 5U
void hal_spi_burst(uint32_t sensor, uint16_t words[HAL_BURST_WORDS]);

/* SPI clock, kHz. */
uint32_t hal_spi_khz(void);

/* Temperature of the board, 0.01 °C; HAL_NO_TEMPERATURE where nothing measures it. */
#define HAL_NO_TEMPERATURE INT16_MIN
int16_t hal_temperature(void);

/* Free-running time, microseconds since reset. */
uint32_t hal_time_us(void);

/* Let at least this time pass. */
void hal_wait_us(uint32_t microseconds);

/* Start the sample timer at rate_hz. */
void hal_timer_start(uint32_t rate_hz);

/* Stop the sample timer. Once this has returned, core_sample() is not called before the next start: an interrupt that was
 * due has been served or is withdrawn. For the main loop, which no sample interrupts half-way and resumes. */
void hal_timer_stop(void);

/* Let the next sample, and all after it, come later. For the sample timer's interrupt; at most the time since it. */
void hal_timer_delay(uint32_t microseconds);

/* Tell the transmitter that bytes are waiting. */
void hal_transmit_kick(void);

/* True when every queued byte has left the line. */
bool hal_transmit_idle(void);

/* True if the baud rate can be made within 1 %. */
bool hal_baud_possible(uint32_t baud);
void hal_set_baud(uint32_t baud);

/* Nothing that interrupts do can happen between lock and unlock; pairs may enclose each other. */
void hal_lock(void);
void hal_unlock(void);

#endif
