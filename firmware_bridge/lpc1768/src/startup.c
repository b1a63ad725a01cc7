/* Vector table and reset. The build puts the boot ROM's checksum into word 7 of the table. */
#include <stddef.h>
#include <stdint.h>

extern uint32_t _sidata;
extern uint32_t _sdata;
extern uint32_t _edata;
extern uint32_t _sbss;
extern uint32_t _ebss;
extern uint32_t _estack;

int main(void);
void Reset_Handler(void);
void SysTick_Handler(void);
void TIMER0_Handler(void);
void UART0_Handler(void);

/* An exception that nobody expects: stop feeding the watchdog, so that it resets the board. */
void Default_Handler(void)
{
    for (;;) {
    }
}

/* Images that do not use one of these leave it to the default. */
void SysTick_Handler(void) __attribute__((weak, alias("Default_Handler")));
void UART0_Handler(void) __attribute__((weak, alias("Default_Handler")));

typedef void (*vector)(void);

__attribute__((section(".isr_vector"), used)) static const vector vectors[16 + 35] = {
    (vector)(&_estack), Reset_Handler,   Default_Handler, Default_Handler, /* NMI, hard fault */
    Default_Handler,    Default_Handler, Default_Handler, NULL,            /* faults, checksum */
    NULL,               NULL,            NULL,            Default_Handler, /* SVCall */
    Default_Handler,    NULL,            Default_Handler, SysTick_Handler, /* debug, PendSV */
    Default_Handler,    TIMER0_Handler,  Default_Handler, Default_Handler, /* WDT, TIMER0…2 */
    Default_Handler,    UART0_Handler,   Default_Handler, Default_Handler, /* TIMER3, UART0…2 */
    Default_Handler,    Default_Handler, Default_Handler, Default_Handler, /* UART3, PWM1, I2C0…1 */
    Default_Handler,    Default_Handler, Default_Handler, Default_Handler, /* I2C2, SPI, SSP0…1 */
    Default_Handler,    Default_Handler, Default_Handler, Default_Handler, /* PLL0, RTC, EINT0…1 */
    Default_Handler,    Default_Handler, Default_Handler, Default_Handler, /* EINT2…3, ADC, BOD */
    Default_Handler,    Default_Handler, Default_Handler, Default_Handler, /* USB, CAN, GPDMA, I2S */
    Default_Handler,    Default_Handler, Default_Handler, Default_Handler, /* Ethernet, RIT, PWM, QEI */
    Default_Handler,    Default_Handler, Default_Handler,                  /* PLL1, USB and CAN activity */
};

void Reset_Handler(void)
{
    const uint32_t *source = &_sidata;
    for (uint32_t *word = &_sdata; word < &_edata; word++) {
        *word = *source;
        source++;
    }
    for (uint32_t *word = &_sbss; word < &_ebss; word++) {
        *word = 0U;
    }
    (void)main();
    Default_Handler();
}

/* The compiler may call these for assignments of structures. */
void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    volatile uint8_t *target = to;
    const uint8_t *source = from;
    for (size_t i = 0U; i < count; i++) {
        target[i] = source[i];
    }
    return to;
}

void *memset(void *to, int value, size_t count)
{
    volatile uint8_t *target = to;
    for (size_t i = 0U; i < count; i++) {
        target[i] = (uint8_t)value;
    }
    return to;
}
