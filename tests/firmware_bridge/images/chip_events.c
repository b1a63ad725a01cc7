/* An image that waits for the chips' interrupt pins: taps, activity and free fall of sensors 1 and 2 on INT1, every
 * conversion of sensor 3 on INT2. Runs on the internal oscillator. */
#include <stdint.h>

#define REG(a) (*(volatile uint32_t *)(a))

extern uint32_t _estack;
volatile uint32_t wakes, singles, doubles, activities, inactivities, falls, ready, status, last_us, falling_edges;

static uint32_t spi(uint32_t sensor, uint32_t address, uint32_t value)
{
    REG(0x2009C05C) = 1U << sensor;
    REG(0x40030008) = address;
    REG(0x40030008) = value;
    while (REG(0x4003000C) & 0x10) {
    }
    (void)REG(0x40030008);
    value = REG(0x40030008);
    REG(0x2009C058) = 1U << sensor;
    return value;
}

static void look(uint32_t sensor)
{
    uint32_t kept = spi(sensor, 0xAB, 0);
    uint32_t source = spi(sensor, 0xB0, 0);
    singles += source >> 6 & 1;
    doubles += source >> 5 & 1;
    activities += source >> 4 & 1;
    inactivities += source >> 3 & 1;
    falls += source >> 2 & 1;
    status = status << 8 | kept;
}

void EINT3_Handler(void)
{
    uint32_t rising = REG(0x40028084);
    falling_edges += REG(0x40028088) >> 15 & 1;
    REG(0x4002808C) = 0xFFFFFFFF;
    wakes++;
    if (rising & 1U << 15)
        look(0);
    if (rising & 1U << 16)
        look(1);
    if (rising & 1U << 25) {
        ready++;
        (void)spi(2, 0xB2, 0);
    }
}

static void set_up(uint32_t sensor, uint32_t enable, uint32_t map)
{
    static const uint8_t values[][2] = {
        {0x1D, 48}, {0x21, 16}, {0x22, 16}, {0x23, 64}, {0x2A, 7}, {0x24, 32}, {0x25, 16}, {0x26, 1}, {0x27, 0x77},
        {0x28, 6}, {0x29, 4}, {0x31, 0x0B},
    };
    for (uint32_t k = 0; k < sizeof values / sizeof values[0]; k++)
        (void)spi(sensor, values[k][0], values[k][1]);
    (void)spi(sensor, 0x2F, map);
    (void)spi(sensor, 0x2D, sensor == 1 ? 0x38 : 0x08);
    (void)spi(sensor, 0x2E, enable);
}

int main(void)
{
    REG(0x2009C058) = 0xF;
    REG(0x2009C040) = 0xF;
    REG(0x40030000) = 0xC7;
    REG(0x40030010) = 2;
    REG(0x40030004) = 2;
    REG(0x40028090) = 1U << 15 | 1U << 16 | 1U << 25;
    REG(0x40028094) = 1U << 15;
    REG(0xE000E100) = 1U << 21;
    set_up(0, 0x64, 0);
    set_up(1, 0x18, 0);
    set_up(2, 0x80, 0x80);
    for (;;)
        __asm volatile("wfi" ::: "memory");
    return 0;
}

static void stop(void)
{
    for (;;) {
    }
}

__attribute__((section(".isr_vector"), used)) static void *const vectors[16 + 22] = {
    [0] = &_estack,
    [1] = (void *)main,
    [3] = (void *)stop,
    [16 + 21] = (void *)EINT3_Handler,
};
