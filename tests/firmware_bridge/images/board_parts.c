/* An image that uses ADC, RTC, RIT, EINT0, EINT3 and PWM1, polling and by interrupt, and leaves what it found in
 * variables that the test reads by name. Runs on the internal oscillator: 4 MHz, peripherals at a quarter of it. */
#include <stdint.h>

#define REG(a) (*(volatile uint32_t *)(a))
#define RTC 0x40024000
#define ADC 0x40034000
#define PWM 0x40018000
#define RIT 0x400B0000

extern uint32_t _estack;
volatile uint32_t done, adc_polled, adc_channel, adc_again, adc_burst, adc_interrupts, adc_microseconds, rtc_seconds, rtc_alarms,
    rtc_day, rtc_month, rtc_year, rit_count, rit_counter, pwm_matches, pwm_first, pwm_second, eint0_count, eint3_count, eint_flags;

static void idle(void) { __asm volatile("wfi" ::: "memory"); }

void ADC_Handler(void)
{
    adc_interrupts++;
    adc_burst |= 1U << (REG(ADC + 0x04) >> 24 & 7);
    if (adc_interrupts == 4)
        REG(ADC) = 1;
}
void RTC_Handler(void)
{
    uint32_t flags = REG(RTC);
    rtc_seconds += flags & 1;
    rtc_alarms += flags >> 1 & 1;
    REG(RTC) = flags;
}
void RIT_Handler(void)
{
    rit_count++;
    REG(RIT + 8) = 0xB;
}
void PWM_Handler(void)
{
    uint32_t now = REG(0x40008008);
    REG(PWM) = REG(PWM);
    pwm_matches++;
    if (pwm_matches == 1) {
        pwm_first = now;
        REG(PWM + 0x18) = 1999;
        REG(PWM + 0x50) = 1; /* from the next period on */
    }
    if (pwm_matches == 3)
        pwm_second = now - pwm_first;
}
void EINT0_Handler(void)
{
    eint0_count++;
    REG(0x400FC140) = 1;
}
void EINT3_Handler(void)
{
    eint_flags = REG(0x400FC140);
    eint3_count++;
    REG(0x400FC140) = 8;
}

int main(void)
{
    REG(0x40008004) = 1; /* TIMER1: microseconds */
    REG(0xE000E100) = 1U << 9 | 1U << 17 | 1U << 18 | 1U << 21 | 1U << 22 | 1U << 29;

    /* ADC: channel 3 once, polled; then a burst over channels 1 and 3. */
    REG(ADC + 0x0C) = 0;
    uint32_t began = REG(0x40008008), value;
    REG(ADC) = 1U << 3 | 1U << 21 | 1U << 24;
    do {
        value = REG(ADC + 0x04);
    } while (!(value >> 31));
    adc_microseconds = REG(0x40008008) - began;
    adc_polled = value >> 4 & 0xFFF;
    adc_channel = value >> 24 & 7;
    adc_again = REG(ADC + 0x04) >> 31;
    REG(ADC + 0x0C) = 1U << 3 | 1U << 1;
    REG(ADC + 0x0C) = 0x100;
    REG(ADC) = 1U << 1 | 1U << 3 | 1U << 21 | 1U << 16;
    while (adc_interrupts < 4)
        idle();

    /* PWM1: a period of 1 ms, from the second on 2 ms. */
    REG(PWM + 0x18) = 999;
    REG(PWM + 0x14) = 3;
    REG(PWM + 0x04) = 9;
    while (pwm_matches < 3)
        idle();
    REG(PWM + 0x04) = 0;

    /* RIT: every 5 ms. */
    REG(RIT + 0x08) = 0;
    REG(RIT + 0x0C) = 0;
    REG(RIT) = 4999;
    REG(RIT + 0x08) = 0xA;
    while (rit_count < 10)
        idle();
    rit_counter = REG(RIT + 0x0C);
    REG(RIT + 0x08) = 0;

    /* RTC: two seconds before the leap day of 2028; an alarm at its first. */
    REG(RTC + 0x08) = 2;
    REG(RTC + 0x20) = 58, REG(RTC + 0x24) = 59, REG(RTC + 0x28) = 23;
    REG(RTC + 0x2C) = 28, REG(RTC + 0x38) = 2, REG(RTC + 0x3C) = 2028;
    REG(RTC + 0x60) = 0;
    REG(RTC + 0x10) = 0xFE;
    REG(RTC + 0x0C) = 1;
    REG(RTC + 0x08) = 1;
    while (!rtc_alarms)
        idle();
    rtc_day = REG(RTC + 0x2C), rtc_month = REG(RTC + 0x38), rtc_year = REG(RTC + 0x18) >> 16;
    REG(RTC + 0x08) = 0;

    /* EINT0 on falling edges, EINT3 while its pin is low. */
    done = 1;
    REG(0x400FC148) = 1;
    REG(0x400FC14C) = 0;
    REG(0x4002C010) = 1U << 20 | 1U << 26;
    for (;;)
        idle();
    return 0;
}

__attribute__((section(".isr_vector"), used)) static void *const vectors[16 + 30] = {
    [0] = &_estack,
    [1] = (void *)main,
    [16 + 9] = (void *)PWM_Handler,
    [16 + 17] = (void *)RTC_Handler,
    [16 + 18] = (void *)EINT0_Handler,
    [16 + 21] = (void *)EINT3_Handler,
    [16 + 22] = (void *)ADC_Handler,
    [16 + 29] = (void *)RIT_Handler,
};
