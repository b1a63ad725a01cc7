/* The hardware side of the firmware's core (hal.h), by the functions of gfimu_port.h: one loop without interrupts. */
#include "gfimu_port.h"

#include "core.h"
#include "hal.h"

#define MICROSECONDS 1000000U
#define LIGHT_IDLE_US 500000U
#define LIGHT_STREAMING_US 250000U
#define BYTES_PER_STEP 16U /* from the host, so that a sample does not wait for a long command */
#define EXCHANGE_WORDS_MAX 8U
#define LOOKS_PER_US 100U /* more than any of these processors looks at its clock: ends the wait if that stands still */

_Static_assert((GFIMU_CHIPS >= 1) && (GFIMU_CHIPS <= SENSOR_COUNT), "GFIMU_CHIPS: one to four chips");
_Static_assert((GFIMU_RESET_WATCHDOG == RESET_WATCHDOG) && (GFIMU_RESET_NO_CRYSTAL == RESET_NO_CRYSTAL), "reset causes");

/* The sample clock: the next sample is due at due_us + fraction / rate_hz. */
static struct {
    bool running;
    uint32_t rate_hz;
    uint32_t due_us;
    uint32_t fraction;
} timer;

/* ---- hal.h ---- */

void hal_spi_exchange(uint32_t sensor, uint16_t *words, uint32_t count)
{
    uint8_t bytes[2U * EXCHANGE_WORDS_MAX];
    for (uint32_t i = 0U; i < count; i++) {
        bytes[2U * i] = (uint8_t)(words[i] >> 8);
        bytes[(2U * i) + 1U] = (uint8_t)words[i];
    }
    if (sensor < (uint32_t)GFIMU_CHIPS) {
        gfimu_port_exchange((uint8_t)sensor, bytes, (uint8_t)(2U * count));
    }
    for (uint32_t i = 0U; i < count; i++) {
        words[i] = (sensor < (uint32_t)GFIMU_CHIPS) ? (uint16_t)(((uint32_t)bytes[2U * i] << 8) | bytes[(2U * i) + 1U])
                                                    : UINT16_MAX; /* nobody answers */
    }
}

void hal_spi_burst(uint32_t sensor, uint16_t words[HAL_BURST_WORDS])
{
    hal_spi_exchange(sensor, words, HAL_BURST_WORDS);
}

uint32_t hal_spi_khz(void)
{
    return gfimu_port_spi_khz();
}

int16_t hal_temperature(void)
{
#ifdef GFIMU_TEMPERATURE
    return gfimu_port_temperature();
#else
    return HAL_NO_TEMPERATURE;
#endif
}

uint32_t hal_time_us(void)
{
    return gfimu_port_time_us();
}

void hal_wait_us(uint32_t microseconds)
{
    uint32_t since_us = gfimu_port_time_us();
    uint32_t looks = microseconds * LOOKS_PER_US;
    while (((gfimu_port_time_us() - since_us) <= microseconds) && (looks > 0U)) {
        looks--;
    }
}

static void next_period(void)
{
    timer.due_us += MICROSECONDS / timer.rate_hz;
    timer.fraction += MICROSECONDS % timer.rate_hz;
    if (timer.fraction >= timer.rate_hz) {
        timer.fraction -= timer.rate_hz;
        timer.due_us++;
    }
}

void hal_timer_start(uint32_t rate_hz)
{
    timer.rate_hz = rate_hz;
    timer.due_us = gfimu_port_time_us();
    timer.fraction = 0U;
    timer.running = true;
    next_period();
}

void hal_timer_stop(void)
{
    timer.running = false;
}

void hal_timer_delay(uint32_t microseconds)
{
    timer.due_us += microseconds;
}

void hal_transmit_kick(void)
{
}

bool hal_transmit_idle(void)
{
    const uint8_t *bytes;
    return (core_transmit_peek(&bytes) == 0U) && gfimu_port_write_idle();
}

bool hal_baud_possible(uint32_t baud)
{
    return gfimu_port_baud_possible(baud);
}

void hal_set_baud(uint32_t baud)
{
    gfimu_port_set_baud(baud);
}

/* The core is called from one thread. */
void hal_lock(void)
{
}

void hal_unlock(void)
{
}

/* ---- loop ---- */

static bool is_due(uint32_t now_us)
{
    return (int32_t)(now_us - timer.due_us) >= 0;
}

static void take_sample(void)
{
    uint32_t now_us = gfimu_port_time_us();
    if (timer.running && is_due(now_us)) {
        do { /* periods that passed without a sample are over: the core reports that this one is late */
            next_period();
        } while (is_due(now_us));
        core_sample();
    }
}

/* Only when the core is done with what came before: the rest waits where the port keeps it. */
static void receive(void)
{
    int16_t byte = core_has_work() ? GFIMU_NOTHING : gfimu_port_read();
    for (uint32_t count = 1U; byte != GFIMU_NOTHING; count++) {
        if (byte == GFIMU_DAMAGED) {
            core_receive_error();
        } else {
            core_receive((uint8_t)byte);
        }
        byte = (count < BYTES_PER_STEP) ? gfimu_port_read() : GFIMU_NOTHING;
    }
}

static void transmit(void)
{
    const uint8_t *bytes;
    uint32_t count = core_transmit_peek(&bytes);
    if (count > 0U) {
        core_transmit_taken(gfimu_port_write(bytes, count));
    }
}

/* All is well while the loop runs and, when streaming, samples are taken. */
static void show_alive(void)
{
    static uint32_t changed_us;
    static uint32_t seen;
    static bool light;
    uint32_t beat = core_heartbeat();
    uint32_t now_us = gfimu_port_time_us();
    if (!core_is_streaming() || (beat != seen)) {
        seen = beat;
        if ((now_us - changed_us) >= (core_is_streaming() ? LIGHT_STREAMING_US : LIGHT_IDLE_US)) {
            changed_us = now_us;
            light = !light;
        }
        gfimu_port_alive(light);
    }
}

void gfimu_sender_begin(uint32_t reset_cause, uint32_t baud)
{
    core_init(reset_cause, baud);
    core_start();
}

void gfimu_sender_step(void)
{
    take_sample();
    receive();
    core_poll();
    transmit();
    show_alive();
}
