/* An image that is not ours: exercises what other LPC1768 firmware uses and leaves the results in variables that the
 * test reads by name. Runs at 96 MHz as the mbed's start-up does. */
#include <stddef.h>
#include <stdint.h>

#define REG(a) (*(volatile uint32_t *)(a))
#define REG8(a) (*(volatile uint8_t *)(a))

extern uint32_t _estack;
extern uint32_t _sbss;
extern uint32_t _ebss;

volatile uint32_t done, cycles_per_us, timer2_matches, systicks, uart1_received, uart1_line, ssp0_echo, i2c_devid;
volatile uint32_t gpio_rising, gpio_falling, bitband_pin, bitband_ram, svc_number, pendsv_order, psp_used, nested_order;
volatile uint32_t basepri_held, icsr_active, level_count, capture_stop, i2c_missing, pll_hz_ok, ahb_word, dma_done, dma_sum;
volatile uint8_t uart1_text[16];
static uint32_t thread_stack[64];

static void idle(void) { __asm volatile("wfi" ::: "memory"); }

void SysTick_Handler(void) { systicks++; }
void TIMER2_Handler(void)
{
    REG(0x40090000) = 1;
    timer2_matches++;
    icsr_active = REG(0xE000ED04) & 0x1FF;
}
void UART1_Handler(void)
{
    uint32_t cause = REG(0x40010008) & 0x0E;
    if (cause == 0x06)
        uart1_line |= REG(0x40010014) & 0x1E;
    if (cause == 0x04 || cause == 0x0C)
        while (REG(0x40010014) & 1)
            uart1_text[uart1_received++ & 15] = (uint8_t)REG(0x40010000);
}
void DMA_Handler(void)
{
    dma_done++;
    REG(0x50004008) = REG(0x50004004);
}
void EINT3_Handler(void)
{
    gpio_rising |= REG(0x400280A4);
    gpio_falling |= REG(0x400280A8);
    REG(0x400280AC) = 0xFFFFFFFF;
}
/* A level that stays high asks again as soon as the handler returns. */
void TIMER3_Handler(void)
{
    if (++level_count == 3)
        REG(0x40094000) = 1;
}
void SVC_Handler(void)
{
    uint32_t *frame;
    __asm volatile("mrs %0, psp" : "=r"(frame));
    uint16_t instruction = *(uint16_t *)(frame[6] - 2);
    svc_number = instruction & 0xFF;
    frame[0] = 0x600D;
    REG(0xE000ED04) = 1u << 28; /* PendSV waits until this handler is through */
    pendsv_order = pendsv_order * 10 + 1;
}
void PendSV_Handler(void) { pendsv_order = pendsv_order * 10 + 2; }
void Fault_Handler(void)
{
    done = 0xDEAD;
    for (;;)
        idle();
}

static void i2c_start(uint32_t address)
{
    REG(0x4001C000) = 0x20;
    REG(0x4001C018) = 0x08;
    while (!(REG(0x4001C000) & 8)) {
    }
    REG(0x4001C008) = address;
    REG(0x4001C018) = 0x28;
    while (!(REG(0x4001C000) & 8)) {
    }
}

static uint32_t read_i2c_register(uint32_t address, uint32_t number)
{
    i2c_start(address << 1);
    if (REG(0x4001C004) != 0x18) {
        REG(0x4001C000) = 0x10;
        REG(0x4001C018) = 0x08;
        return 0xFFFF;
    }
    REG(0x4001C008) = number;
    REG(0x4001C018) = 0x08;
    while (!(REG(0x4001C000) & 8)) {
    }
    i2c_start(address << 1 | 1);
    REG(0x4001C018) = 0x0C; /* receive one byte, do not acknowledge */
    while (!(REG(0x4001C000) & 8)) {
    }
    uint32_t value = REG(0x4001C008);
    REG(0x4001C000) = 0x10;
    REG(0x4001C018) = 0x08;
    return value;
}

__attribute__((noinline)) static uint32_t supervisor_call(void)
{
    register uint32_t result __asm("r0") = 5;
    __asm volatile("svc 42" : "+r"(result)::"memory");
    return result;
}

int main(void)
{
    /* 12 MHz × 2 × 12 / 1 = 288 MHz, / 3 = 96 MHz */
    REG(0x400FC1A0) = 0x20;
    while (!(REG(0x400FC1A0) & 0x40)) {
    }
    REG(0x400FC10C) = 1;
    REG(0x400FC084) = 11;
    REG(0x400FC08C) = 0xAA;
    REG(0x400FC08C) = 0x55;
    REG(0x400FC104) = 2;
    REG(0x400FC080) = 3;
    REG(0x400FC08C) = 0xAA;
    REG(0x400FC08C) = 0x55;
    pll_hz_ok = (REG(0x400FC088) >> 24 & 7) == 7;

    /* TIMER2 at CCLK/4 against the cycle counter: 24 counts are 96 cycles, 1 µs. */
    REG(0xE000EDFC) = 1u << 24;
    REG(0xE0001000) = 1;
    REG(0x40090004) = 2;
    REG(0x40090004) = 1;
    uint32_t cycles = REG(0xE0001004), counts = REG(0x40090008);
    while (REG(0x40090008) - counts < 24000) {
    }
    cycles_per_us = (REG(0xE0001004) - cycles + 500) / 1000;

    /* TIMER2 interrupts every 100 µs; it stops itself at match 1. */
    REG(0x40090004) = 2;
    REG(0x40090018) = 2399;
    REG(0x40090014) = 3;
    REG(0xE000E100) = 1u << 3;
    REG(0x40090004) = 1;
    while (timer2_matches < 5)
        idle();
    REG(0xE000E180) = 1u << 3;
    REG(0x40090014) = 4; /* stop on match 0 */
    REG(0x40090004) = 2;
    REG(0x40090004) = 1;
    for (volatile uint32_t i = 0; i < 5000; i++) {
    }
    capture_stop = REG(0x40090008);

    /* SysTick every 1 ms, interrupting a loop that does not sleep. */
    REG(0xE000E014) = 95999;
    REG(0xE000E018) = 0;
    REG(0xE000E010) = 7;
    while (systicks < 3) {
    }
    /* BASEPRI holds it back. */
    REG8(0xE000ED23) = 0x40;
    __asm volatile("msr basepri, %0" ::"r"(0x20));
    uint32_t before = systicks;
    uint32_t start = REG(0xE0001004);
    while (REG(0xE0001004) - start < 96000 * 3) {
    }
    basepri_held = systicks == before && (REG(0xE000ED04) >> 26 & 1);
    __asm volatile("msr basepri, %0" ::"r"(0));
    __asm volatile("isb");
    basepri_held += systicks == before + 1 ? 1 : 0;
    REG(0xE000E010) = 0;

    /* UART1 at 96 MHz / 4 / 16 / 13 = 115385 baud; the test sends five bytes: one interrupt by time-out. */
    REG(0x4001000C) = 0x83;
    REG(0x40010000) = 13;
    REG(0x40010004) = 0;
    REG(0x4001000C) = 0x03;
    REG(0x40010008) = 0xC7;
    REG(0x40010004) = 5;
    REG(0xE000E100) = 1u << 6;
    done = 1; /* the test sends now */
    while (uart1_received < 5)
        idle();

    /* SSP0 in loop-back, 8 bits. */
    REG(0x40088000) = 7;
    REG(0x40088010) = 4;
    REG(0x40088004) = 3;
    REG(0x40088008) = 0xA7;
    while (!(REG(0x4008800C) & 4)) {
    }
    ssp0_echo = REG(0x40088008);

    /* I2C0: the DEVID of an ADXL345 at 0x53; nobody at 0x20. */
    REG(0x4001C010) = 120;
    REG(0x4001C014) = 120;
    REG(0x4001C000) = 0x40;
    i2c_devid = read_i2c_register(0x53, 0);
    i2c_missing = read_i2c_register(0x20, 0);

    /* GPIO interrupts of P2.10; the test moves the pin. */
    REG(0x400280B0) = 1u << 10;
    REG(0x400280B4) = 1u << 10;
    REG(0xE000E100) = 1u << 21;
    done = 2;
    while (!gpio_rising || !gpio_falling)
        idle();

    /* Bit-band aliases: P2.4 through FIO2SET, and a bit of the AHB RAM. */
    REG(0x2009C040) |= 1u << 4;
    REG(0x22000000 + (0x9C058 * 32) + 4 * 4) = 1;
    bitband_pin = REG(0x2009C054) >> 4 & 1;
    REG(0x2007C000) = 0;
    REG(0x22000000 + (0x7C000 * 32) + 7 * 4) = 1;
    bitband_ram = REG(0x2007C000);
    ahb_word = REG(0x22000000 + (0x7C000 * 32) + 7 * 4);

    /* A level-sensitive line: the handler clears it the third time. */
    REG(0x40094018) = 100;
    REG(0x40094014) = 5;
    REG(0xE000E100) = 1u << 4;
    REG(0x40094004) = 1;
    while (level_count < 3)
        idle();

    /* DMA: one linked list of two items copies words in the AHB RAM; then five bytes go out of UART1. */
    static const char hello[] = "world";
    static volatile uint32_t list[4];
    volatile uint32_t *ahb = (volatile uint32_t *)0x2007C100;
    for (uint32_t i = 0; i < 8; i++)
        ahb[i] = 0x1000 + i;
    list[0] = 0x2007C110;
    list[1] = 0x2007C210;
    list[2] = 0;
    list[3] = 4 | 2u << 18 | 2u << 21 | 3u << 26 | 1u << 31;
    REG(0x50004030) = 1;
    REG(0x50004100) = 0x2007C100;
    REG(0x50004104) = 0x2007C200;
    REG(0x50004108) = (uint32_t)list;
    REG(0x5000410C) = 4 | 2u << 18 | 2u << 21 | 3u << 26;
    REG(0xE000E100) = 1u << 26;
    REG(0x50004110) = 1 | 1u << 15;
    while (!dma_done)
        idle();
    dma_sum = 0;
    for (uint32_t i = 0; i < 8; i++)
        dma_sum += ((volatile uint32_t *)0x2007C200)[i];
    REG(0x50004120) = (uint32_t)hello;
    REG(0x50004124) = 0x40010000;
    REG(0x50004128) = 0;
    REG(0x5000412C) = 5 | 1u << 26 | 1u << 31;
    REG(0x50004130) = 1 | 10u << 6 | 1u << 11 | 1u << 15;
    while (dma_done < 2)
        idle();

    /* The thread on its own stack asks the supervisor; PendSV follows after it. */
    __asm volatile("msr psp, %0" ::"r"(&thread_stack[64]));
    __asm volatile("msr control, %0\n isb" ::"r"(2));
    psp_used = supervisor_call();
    done = 3;
    for (;;)
        idle();
    return 0;
}

void Reset_Handler(void)
{
    for (uint32_t *word = &_sbss; word < &_ebss; word++)
        *word = 0U;
    (void)main();
}

typedef void (*vector)(void);
__attribute__((section(".isr_vector"), used)) static const vector vectors[16 + 35] = {
    (vector)(&_estack), Reset_Handler, Fault_Handler, Fault_Handler, Fault_Handler, Fault_Handler, Fault_Handler, NULL,
    NULL, NULL, NULL, SVC_Handler, Fault_Handler, NULL, PendSV_Handler, SysTick_Handler,
    [16 + 3] = TIMER2_Handler, [16 + 4] = TIMER3_Handler, [16 + 6] = UART1_Handler, [16 + 21] = EINT3_Handler,
    [16 + 26] = DMA_Handler,
};
