/* The hardware side of the host build: what the tests set and look at. */
#include <stdbool.h>
#include <stdint.h>

#include "../src/adxl345.h"
#include "../src/core.h"
#include "../src/hal.h"

#if defined(_WIN32)
#define PUBLIC __declspec(dllexport)
#else
#define PUBLIC __attribute__((visibility("default")))
#endif

typedef void (*exchange_function)(uint32_t sensor, uint16_t *words, uint32_t count);

static exchange_function exchange;
static uint32_t time_us;
static uint32_t timer_hz;
static uint32_t delayed_us;
static uint32_t baud;
static int32_t lock_depth;
static int16_t temperature = HAL_NO_TEMPERATURE;

PUBLIC void host_set_exchange(exchange_function function) { exchange = function; }
PUBLIC void host_set_time_us(uint32_t value) { time_us = value; }
PUBLIC void host_set_temperature(int32_t value) { temperature = (int16_t)value; }
PUBLIC uint32_t host_time_us(void) { return time_us; }
PUBLIC uint32_t host_timer_hz(void) { return timer_hz; }
PUBLIC uint32_t host_delayed_us(void) { return delayed_us; }
PUBLIC uint32_t host_baud(void) { return baud; }
PUBLIC int32_t host_lock_depth(void) { return lock_depth; }

PUBLIC void host_init(uint32_t cause, uint32_t boot_baud) { baud = boot_baud; core_init(cause, boot_baud); }
PUBLIC void host_start(void) { core_start(); }
PUBLIC void host_sample(void) { core_sample(); }
PUBLIC void host_receive(uint32_t byte) { core_receive((uint8_t)byte); }
PUBLIC void host_poll(void) { core_poll(); }
PUBLIC uint32_t host_has_work(void) { return core_has_work() ? 1U : 0U; }
PUBLIC uint32_t host_peek(const uint8_t **bytes) { return core_transmit_peek(bytes); }
PUBLIC void host_taken(uint32_t count) { core_transmit_taken(count); }
PUBLIC uint32_t host_crc16(const uint8_t *bytes, uint32_t count) { return core_crc16(bytes, count); }
PUBLIC uint32_t host_rate_code(uint32_t rate_hz) { return adxl345_rate_code(rate_hz); }

void hal_spi_exchange(uint32_t sensor, uint16_t *words, uint32_t count) { exchange(sensor, words, count); }
void hal_spi_burst(uint32_t sensor, uint16_t words[HAL_BURST_WORDS]) { exchange(sensor, words, HAL_BURST_WORDS); }
uint32_t hal_spi_khz(void) { return 5000U; }
int16_t hal_temperature(void) { return temperature; }
uint32_t hal_time_us(void) { return time_us; }
void hal_wait_us(uint32_t microseconds) { time_us += microseconds; }
void hal_timer_start(uint32_t rate_hz) { timer_hz = rate_hz; }
void hal_timer_stop(void) { timer_hz = 0U; }
void hal_timer_delay(uint32_t microseconds) { delayed_us += microseconds; }
void hal_transmit_kick(void) {}
bool hal_transmit_idle(void)
{
    const uint8_t *bytes;
    return core_transmit_peek(&bytes) == 0U;
}
bool hal_baud_possible(uint32_t rate) { return (rate >= 9600U) && (rate <= 6250000U); }
void hal_set_baud(uint32_t rate) { baud = rate; }
void hal_lock(void) { lock_depth++; }
void hal_unlock(void) { lock_depth--; }
