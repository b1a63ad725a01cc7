/* A port whose time, bus and line are the test's. */
#include "gfimu_port.h"

#if defined(_WIN32)
#define PUBLIC __declspec(dllexport)
#else
#define PUBLIC __attribute__((visibility("default")))
#endif

#define RING 256U

typedef void (*exchange_function)(uint32_t chip, uint8_t *bytes, uint32_t count);

static exchange_function exchange;
static uint32_t time_us;
static uint32_t baud;
static uint32_t room; /* bytes that the line takes now */
static uint32_t sent;
static uint32_t shown;
static uint8_t line[4096];
static int16_t received[RING];
static uint32_t head;
static uint32_t tail;

PUBLIC void port_set_exchange(exchange_function function) { exchange = function; }
PUBLIC void port_set_time_us(uint32_t value) { time_us = value; }
PUBLIC uint32_t port_baud(void) { return baud; }
PUBLIC void port_give(int32_t byte) { received[head++ % RING] = (int16_t)byte; }
PUBLIC void port_let(uint32_t bytes) { room = bytes; }
PUBLIC uint32_t port_shown(void) { return shown; }
PUBLIC uint32_t port_sent(const uint8_t **bytes)
{
    uint32_t count = sent;
    *bytes = line;
    sent = 0U;
    return count;
}

PUBLIC void port_begin(uint32_t cause, uint32_t boot_baud) { baud = boot_baud; gfimu_sender_begin(cause, boot_baud); }
PUBLIC void port_step(void) { gfimu_sender_step(); }

void gfimu_port_exchange(uint8_t chip, uint8_t *bytes, uint8_t count) { exchange(chip, bytes, count); }
uint32_t gfimu_port_spi_khz(void) { return 5000U; }
uint32_t gfimu_port_time_us(void) { return time_us; }
uint32_t gfimu_port_write(const uint8_t *bytes, uint32_t count)
{
    uint32_t taken = 0U;
    while ((taken < count) && (room > 0U) && (sent < sizeof(line))) {
        line[sent++] = bytes[taken++];
        room--;
    }
    return taken;
}
bool gfimu_port_write_idle(void) { return true; }
int16_t gfimu_port_read(void) { return (tail != head) ? received[tail++ % RING] : GFIMU_NOTHING; }
bool gfimu_port_baud_possible(uint32_t rate) { return (rate >= 9600U) && (rate <= 6250000U); }
void gfimu_port_set_baud(uint32_t rate) { baud = rate; }
void gfimu_port_alive(bool light) { shown += 2U + (light ? 1U : 0U); }
