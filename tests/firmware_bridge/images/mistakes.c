/* One mistake per function; the tests start the image at the one they want. */
#include <stdint.h>

#define R(address) (*(volatile uint32_t *)(address))
#define R8(address) (*(volatile uint8_t *)(address))
#define CASE __attribute__((used, noinline)) void
#define FOR_EVER \
    for (;;) {   \
    }

static volatile uint8_t data[32000]; /* leaves less than 800 bytes for the stack */
static volatile uint32_t counter;

static void powered(void)
{
    R(0x400FC0C4) |= 1U << 3 | 1U << 10 | 1U << 15;
}

CASE reserved_bits(void)
{
    R(0x400FC000) = 0x4000;
    FOR_EVER
}

static void feed(void)
{
    R(0x400FC08C) = 0xAA;
    R(0x400FC08C) = 0x55;
}

static void fast_clock(void)
{
    R(0x400FC1A0) = 0x20;
    while (!(R(0x400FC1A0) & 0x40)) {
    }
    R(0x400FC104) = 3;
    R(0x400FC10C) = 1;
    R(0x400FC084) = 5U << 16 | 99;
    feed();
    R(0x400FC080) = 1;
    feed();
    while (!(R(0x400FC088) & 1U << 26)) {
    }
    R(0x400FC080) = 3;
    feed();
}

CASE flash_wait_late(void)
{
    fast_clock();
    R(0x400FC000) = 0x403A;
    FOR_EVER
}

CASE input_pin_not_selected(void)
{
    R(0x4000C004) = 1;
    FOR_EVER
}

CASE partial_register(void)
{
    R8(0x4000400D) = 1;
    FOR_EVER
}

static void spi(uint32_t divider)
{
    powered();
    R(0x4002C000) = 2U << 14 | 2U << 16 | 2U << 18;
    R(0x2009C058) = 15;
    R(0x2009C040) = 15;
    R(0x40030000) = 0xC7 | divider << 8;
    R(0x40030010) = 2;
    R(0x40030004) = 2;
}

static void exchange(const uint8_t *bytes, uint32_t count)
{
    R(0x2009C05C) = 1;
    for (uint32_t i = 0; i < count; i++) {
        R(0x40030008) = bytes[i];
    }
    while (R(0x4003000C) & 0x10) {
    }
    for (uint32_t i = 0; i < count; i++) {
        (void)R(0x40030008);
    }
    R(0x2009C058) = 1;
    for (volatile uint32_t i = 0; i < 5; i++) {
    }
}

CASE ssp_disabled(void)
{
    spi(1);
    R(0x40030004) = 0;
    R(0x2009C05C) = 1;
    R(0x40030008) = 0;
    FOR_EVER
}

CASE ssp_changed_while_busy(void)
{
    spi(1);
    R(0x2009C05C) = 1;
    R(0x40030008) = 0;
    R(0x40030000) = 0xC7;
    FOR_EVER
}

CASE ssp_overrun(void)
{
    spi(0);
    R(0x2009C05C) = 1;
    for (uint32_t i = 0; i < 10; i++) {
        R(0x40030008) = i;
        while (R(0x4003000C) & 0x10) {
        }
    }
    FOR_EVER
}

static const uint8_t measure[] = {0x2D, 8}, one_axis[] = {0xF2, 0, 0}, all_axes[] = {0xF2, 0, 0, 0, 0, 0, 0};
static const uint8_t fast[] = {0x2C, 15}, stream[] = {0x38, 0x80};

CASE torn_sample(void)
{
    spi(1);
    exchange(measure, 2);
    exchange(one_axis, 3);
    FOR_EVER
}

CASE spi_too_slow(void)
{
    spi(3); /* 1 MHz / 8 */
    exchange(fast, 2);
    exchange(measure, 2);
    exchange(all_axes, 7);
    FOR_EVER
}

CASE chip_fifo_rest(void)
{
    R(0x400FC1A8) = 1U << 20;
    R(0x400FC000) = 0x403A;
    fast_clock();
    spi(9);
    exchange(stream, 2);
    exchange(measure, 2);
    exchange(all_axes, 7);
    exchange(all_axes, 7);
    FOR_EVER
}

CASE watchdog_late(void)
{
    R(0x40000004) = 2000;
    R(0x40000000) = 3;
    R(0x40000008) = 0xAA;
    R(0x40000008) = 0x55;
    while (R(0x4000000C) > 100) {
    }
    R(0x40000004) = 0xFFFFFF;
    R(0x40000008) = 0xAA;
    R(0x40000008) = 0x55;
    FOR_EVER
}

__attribute__((used)) void SysTick_Handler(void)
{
    counter++;
    FOR_EVER
}

CASE dead_handler(void)
{
    R(0xE000E014) = 1000;
    R(0xE000E010) = 7;
    FOR_EVER
}

CASE stack_low(void)
{
    volatile uint8_t some[650];
    for (uint32_t i = 0; i < sizeof some; i++) {
        some[i] = data[i];
    }
    FOR_EVER
}

CASE watchdog_without_reset(void)
{
    R(0x40000004) = 100000;
    R(0x40000000) = 1;
    R(0x40000008) = 0xAA;
    R(0x40000008) = 0x55;
    FOR_EVER
}

CASE deep_sleep(void)
{
    R(0xE000ED10) = 4;
    FOR_EVER
}

CASE uart_parity(void)
{
    powered();
    R(0x4002C000) |= 1U << 4 | 1U << 6;
    R(0x4000C00C) = 0x9B;
    R(0x4000C000) = 13;
    R(0x4000C004) = 0;
    R(0x4000C028) = 0x10;
    R(0x4000C00C) = 0x1B;
    R(0x4000C008) = 7;
    R(0x4000C000) = 'x';
    FOR_EVER
}

CASE wait_for_outside(void)
{
    while (R(0x2009C014) & 1) {
    }
    FOR_EVER
}

/* Nothing wrong with these. */

CASE bounded_wait(void)
{
    for (uint32_t i = 0; i < 20000 && !(R(0x400FC1A0) & 0x40); i++) {
    }
    FOR_EVER
}

CASE bounded_by_memory(void)
{
    for (counter = 0; counter < 15000 && !(R(0x400FC1A0) & 0x40); counter++) {
    }
    FOR_EVER
}

CASE waits_for_a_character(void)
{
    powered();
    R(0x4002C000) = 5U << 4;
    R(0x4000C008) = 7;
    while (!(R(0x4000C014) & 1)) {
    }
    FOR_EVER
}

CASE waits_for_time(void)
{
    R(0x40004004) = 1;
    while (R(0x40004008) < 60000) {
    }
    FOR_EVER
}

/* A reader drains the receive FIFO before its first exchange, full or not (common in NXP's examples). */
CASE drains_first(void)
{
    spi(1);
    for (uint32_t i = 0; i < 8; i++) {
        (void)R(0x40030008);
    }
    exchange(measure, 2);
    FOR_EVER
}

__attribute__((section(".isr_vector"), used)) static void *const vectors[16] = {
    (void *)0x10008000, (void *)reserved_bits, [15] = (void *)SysTick_Handler,
};
