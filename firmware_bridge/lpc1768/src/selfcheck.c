/* Proof of interrupt handling: the main loop computes a known hash over and over (all registers live, flags, IT blocks,
 * 64-bit arithmetic) while SysTick and TIMER0 interrupt it, and each other, at unrelated rates. Nothing sleeps.
 * The counters are read from outside by their symbols. */
#include "lpc1768.h"

#define SYSTICK_EXCEPTION 15U
#define TIMER0_EXCEPTION 17U
#define SYSTICK_PERIOD 7919U
#define TIMER0_PERIOD 31249U

volatile uint32_t selfcheck_good;
volatile uint32_t selfcheck_bad;
volatile uint32_t selfcheck_timer0;
volatile uint32_t selfcheck_systick;
volatile uint32_t selfcheck_nested;
volatile uint32_t selfcheck_wrong_ipsr;
static volatile uint32_t in_timer0;

void SysTick_Handler(void);
void TIMER0_Handler(void);

static uint32_t ipsr(void)
{
    uint32_t value;
    __asm volatile("mrs %0, ipsr" : "=r"(value));
    return value;
}

static uint32_t hash(uint32_t seed, uint32_t rounds)
{
    uint32_t a = seed;
    uint32_t b = 0U;
    uint32_t c = 1U;
    int64_t d = 0;
    for (uint32_t i = 0U; i < rounds; i++) {
        a ^= a << 13;
        a ^= a >> 17;
        a ^= a << 5;
        if ((a & 1U) != 0U) {
            b += a;
        } else {
            b ^= a;
        }
        if ((a & 6U) == 6U) {
            c = (c * 3U) + 1U;
        }
        if ((a >> 31) != 0U) {
            d -= (int64_t)a;
        } else {
            d += (int64_t)a;
        }
        b = (b << 3) | (b >> 29);
    }
    return a ^ b ^ c ^ (uint32_t)d ^ (uint32_t)((uint64_t)d >> 32);
}

void TIMER0_Handler(void)
{
    T0IR = 1U;
    if (ipsr() != TIMER0_EXCEPTION) {
        selfcheck_wrong_ipsr++;
    }
    in_timer0 = 1U;
    selfcheck_timer0++;
    volatile uint32_t sink = hash(selfcheck_timer0, 40U);
    (void)sink;
    in_timer0 = 0U;
}

void SysTick_Handler(void)
{
    if (ipsr() != SYSTICK_EXCEPTION) {
        selfcheck_wrong_ipsr++;
    }
    selfcheck_systick++;
    if (in_timer0 != 0U) {
        selfcheck_nested++;
    }
    volatile uint32_t sink = hash(selfcheck_systick, 5U);
    (void)sink;
}

int main(void)
{
    const uint32_t reference = hash(0x12345678U, 200U);
    SYSTEM_PRIORITY(SYSTICK_EXCEPTION) = 0U;
    NVIC_PRIORITY(IRQ_TIMER0) = 2U << NVIC_PRIORITY_SHIFT;
    SYST_RVR = SYSTICK_PERIOD;
    SYST_CVR = 0U;
    SYST_CSR = 7U;
    T0PR = 0U;
    T0MR0 = TIMER0_PERIOD;
    T0MCR = TIMER_MR0_INTERRUPT | TIMER_MR0_RESET;
    NVIC_ISER0 = 1U << IRQ_TIMER0;
    T0TCR = TIMER_ENABLE;
    for (;;) {
        volatile uint32_t seed = 0x12345678U;
        if (hash(seed, 200U) == reference) {
            selfcheck_good++;
        } else {
            selfcheck_bad++;
        }
    }
    return 0;
}
