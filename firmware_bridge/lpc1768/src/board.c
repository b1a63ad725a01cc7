/* The hardware side: clocks, SSP1 with GPIO chip-selects, timers, UART0, watchdog, main loop. */
#include "core.h"
#include "hal.h"
#include "lpc1768.h"

#ifndef GFIMU_SPI_HZ
#define GFIMU_SPI_HZ 5000000U
#endif
#ifndef GFIMU_BOOT_BAUD
#define GFIMU_BOOT_BAUD 115200U /* what every USB-serial bridge can do */
#endif
#define LED_MBED (1U << 18)       /* P1.18: LED1 of the mbed */
#define LED_LPCXPRESSO (1U << 22) /* P0.22: LED2 of an LPCXpresso */
#define LED_IDLE_US 500000U
#define LED_STREAMING_US 250000U
#ifndef GFIMU_AUTOSTART
#define GFIMU_AUTOSTART 1
#endif

#define CORE_HZ 100000000U /* CCLK; the peripherals used run at CCLK */
#define MICROSECONDS 1000000U
#define BAUD_MIN 9600U
#define SSP_PRESCALER 2U
#define SSP_DIVIDER ((CORE_HZ + (SSP_PRESCALER * GFIMU_SPI_HZ) - 1U) / (SSP_PRESCALER * GFIMU_SPI_HZ))
#define SELECT_REST_LOOPS 5U /* of at least 5 cycles: 250 ns */
#define SPI_PINS 0x0FU /* P2.0…P2.3: chip-selects of sensors 1…4 */
#define SPI_WORD_BITS 16U
#define SPI_WORDS_MAX 8U
/* Looks at the interface, of at least 4 cycles each, in twice the time that the longest exchange takes. */
#define SPI_LOOKS (SPI_WORDS_MAX * SPI_WORD_BITS * SSP_PRESCALER * SSP_DIVIDER * 2U / 4U)

/* Looks at a status bit of the clocks, of at least 4 cycles each: 50 ms at the 4 MHz after reset, 17 ms at 12 MHz. The
 * crystal is given 10 ms as a rule, PLL0 0.5 ms (LPC1768 data sheet, tables 8 and 12). */
#define CLOCK_LOOKS 50000U

#define WATCHDOG_TICKS 2000000U /* 2 s of the 4 MHz internal oscillator, divided by 4 */
#define WATCHDOG_FEED_US 100000U

#define WAKE_TICKS (CORE_HZ / 10U) /* the main loop wakes ten times a second, whether samples are taken or not */

#define PRIORITY_SAMPLE 1U
#define PRIORITY_UART 2U
#define PRIORITY_WAKE 31U

_Static_assert((SSP_DIVIDER >= 1U) && (SSP_DIVIDER <= 256U), "GFIMU_SPI_HZ is out of the SSP's reach");

static volatile bool transmitting;

_Static_assert(WAKE_TICKS <= 0x1000000U, "SysTick counts 24 bits");

void SysTick_Handler(void);
void TIMER0_Handler(void);
void UART0_Handler(void);

/* ---- watchdog ---- */

static void watchdog_feed(void)
{
    hal_lock(); /* the two writes must follow each other (UM10360 28.4.3) */
    WDFEED = 0xAAU;
    WDFEED = 0x55U;
    hal_unlock();
}

/* Runs on the internal oscillator, whatever becomes of the other clocks, and can't be turned off again. */
static void watchdog_start(void)
{
    WDCLKSEL = 0U;
    WDTC = WATCHDOG_TICKS;
    WDMOD = WDMOD_ENABLE_RESET;
    watchdog_feed();
}

static void await_reset(void)
{
    for (;;) {
    }
}

/* ---- clocks ---- */

static void pll_feed(void)
{
    PLL0FEED = 0xAAU;
    PLL0FEED = 0x55U;
}

/* Without a locked PLL0 there is no right clock: the watchdog, which runs already, resets the board for another try. */
static void await_pll(uint32_t mask, uint32_t value)
{
    uint32_t looks = CLOCK_LOOKS;
    while ((PLL0STAT & mask) != value) {
        looks--;
        if (looks == 0U) {
            await_reset();
        }
    }
}

/* A boot loader may leave PLL0 connected: disconnect, then disable, in two feeds (UM10360 4.5.13). */
static void pll_off(void)
{
    PLL0CON &= ~PLL0_CONNECT;
    pll_feed();
    await_pll(PLL0STAT_CONNECTED, 0U);
    PLL0CON = 0U;
    pll_feed();
    await_pll(PLL0STAT_ENABLED, 0U);
}

/* False if the crystal does not start in time. */
static bool crystal_start(void)
{
    uint32_t looks = CLOCK_LOOKS;
    SCS |= SCS_CRYSTAL_ON;
    while (((SCS & SCS_CRYSTAL_READY) == 0U) && (looks > 0U)) {
        looks--;
    }
    return looks > 0U;
}

/* 12 MHz crystal × 2 × 100 / 6 = 400 MHz, / 4 = 100 MHz (UM10360 4.5.13). Without the crystal, the internal oscillator
 * (4 MHz ± 1 %) × 2 × 50 gives the same. Returns whether the crystal runs.
 * The peripheral clocks are selected first: written once PLL0 is connected, PCLKSEL0 and PCLKSEL1 may not take effect
 * (NXP's errata sheet ES_LPC176x, PCLKSELx.1). The flash gets its wait states before the clock gets fast. */
static bool clock_init(void)
{
    pll_off();
    PCLKSEL0 = (1U << 2) | (1U << 4) | (1U << 6) | (1U << 20); /* TIMER0, TIMER1, UART0, SSP1 at CCLK */
    PCLKSEL1 = 0U;
    bool crystal = crystal_start();
    FLASHCFG = (FLASHCFG & 0xFFFU) | 0x4000U;
    CCLKCFG = 3U;
    CLKSRCSEL = crystal ? CLKSRC_CRYSTAL : CLKSRC_INTERNAL;
    PLL0CFG = crystal ? ((5U << 16) | 99U) : 49U;
    pll_feed();
    PLL0CON = PLL0_ENABLE;
    pll_feed();
    await_pll(PLL0STAT_LOCKED, PLL0STAT_LOCKED);
    PLL0CON = PLL0_ENABLE | PLL0_CONNECT;
    pll_feed();
    await_pll(PLL0STAT_CONNECTED, PLL0STAT_CONNECTED);
    PCONP |= PCONP_TIMER0 | PCONP_TIMER1 | PCONP_UART0 | PCONP_SSP1 | PCONP_GPIO;
    return crystal;
}

/* ---- SPI ---- */

static void spi_init(void)
{
    PINSEL0 = (1U << 4) | (1U << 6) | (2U << 14) | (2U << 16) | (2U << 18); /* TXD0, RXD0, SCK1, MISO1, MOSI1 */
    PINSEL4 &= ~0xFFU;
    FIO2SET = SPI_PINS;
    FIO2DIR |= SPI_PINS;
    SSP1CR0 = SSP_CR0_16_BIT | SSP_CR0_MODE_3 | ((SSP_DIVIDER - 1U) << SSP_CR0_DIVIDER_SHIFT);
    SSP1CPSR = SSP_PRESCALER;
    SSP1CR1 = SSP_CR1_ENABLE;
}

/* A chip wants its CS high for 150 ns between two accesses (ADXL345 data sheet, table 10, tCS,DIS). Sampling visits each
 * chip once and needs no rest. */
static void select_rest(void)
{
    for (volatile uint32_t i = 0U; i < SELECT_REST_LOOPS; i++) {
    }
}

/* False if the words are not through in time. */
static bool spi_await(void)
{
    uint32_t looks = SPI_LOOKS;
    uint32_t busy;
    do {
        busy = SSP1SR & SSP_SR_BUSY;
        looks--;
    } while ((uint32_t)(busy != 0U) & (uint32_t)(looks > 0U)); /* one branch: this runs for each chip of each sample */
    return busy == 0U;
}

/* After an exchange that did not end: no word may be left for the next one. */
SELDOM static void spi_recover(void)
{
    SSP1CR1 = 0U;
    for (uint32_t i = 0U; (i < SPI_WORDS_MAX) && ((SSP1SR & SSP_SR_RECEIVED) != 0U); i++) {
        (void)SSP1DR;
    }
    SSP1CR1 = SSP_CR1_ENABLE;
}

void hal_spi_exchange(uint32_t sensor, uint16_t *words, uint32_t count)
{
    FIO2CLR = 1U << sensor;
    for (uint32_t i = 0U; i < count; i++) {
        SSP1DR = words[i];
    }
    if (spi_await()) {
        for (uint32_t i = 0U; i < count; i++) {
            words[i] = (uint16_t)SSP1DR;
        }
    } else {
        spi_recover();
        for (uint32_t i = 0U; i < count; i++) {
            words[i] = UINT16_MAX; /* nobody answered */
        }
    }
    FIO2SET = 1U << sensor;
    select_rest();
}

void hal_spi_burst(uint32_t sensor, uint16_t words[HAL_BURST_WORDS])
{
    FIO2CLR = 1U << sensor;
    for (uint32_t i = 0U; i < HAL_BURST_WORDS; i++) {
        SSP1DR = words[i];
    }
    if (spi_await()) {
        for (uint32_t i = 0U; i < HAL_BURST_WORDS; i++) {
            words[i] = (uint16_t)SSP1DR;
        }
    } else {
        spi_recover();
        for (uint32_t i = 0U; i < HAL_BURST_WORDS; i++) {
            words[i] = UINT16_MAX; /* nobody answered */
        }
    }
    FIO2SET = 1U << sensor;
}

uint32_t hal_spi_khz(void)
{
    return CORE_HZ / (SSP_PRESCALER * SSP_DIVIDER) / 1000U;
}

/* ---- time ---- */

static void time_init(void)
{
    T1PR = (CORE_HZ / MICROSECONDS) - 1U;
    T1TCR = TIMER_RESET;
    T1TCR = TIMER_ENABLE;
}

int16_t hal_temperature(void)
{
    return HAL_NO_TEMPERATURE; /* neither the LPC1768 nor the ADXL345 has a sensor for it */
}

uint32_t hal_time_us(void)
{
    return T1TC;
}

/* Not longer than a loop of as many looks, of at least 4 cycles each, takes. */
SELDOM void hal_wait_us(uint32_t microseconds)
{
    uint32_t since_us = T1TC;
    uint32_t looks = microseconds * (CORE_HZ / MICROSECONDS);
    while (((T1TC - since_us) <= microseconds) && (looks > 0U)) {
        looks--;
    }
}

void hal_timer_start(uint32_t rate_hz)
{
    T0TCR = TIMER_RESET;
    T0PR = 0U;
    T0MR0 = ((CORE_HZ + (rate_hz / 2U)) / rate_hz) - 1U;
    T0MCR = TIMER_MR0_INTERRUPT | TIMER_MR0_RESET;
    T0IR = 1U;
    barrier(); /* the timer requests nothing any more: what it requested before its stop is forgotten */
    NVIC_ICPR0 = 1U << IRQ_TIMER0;
    NVIC_ISER0 = 1U << IRQ_TIMER0;
    T0TCR = TIMER_ENABLE;
}

/* The interrupt is withdrawn at the NVIC before the timer stops: behind the barrier the processor can't enter its handler,
 * whatever was pending (ARM application note 321, 4.9). UART and SysTick go on being served, as they would not if
 * interrupts were off for as long as the chips are set up. */
void hal_timer_stop(void)
{
    NVIC_ICER0 = 1U << IRQ_TIMER0;
    barrier();
    T0TCR = 0U;
}

/* The counter goes from 0 at one sample to MR0 at the next. */
SELDOM void hal_timer_delay(uint32_t microseconds)
{
    uint32_t cycles = microseconds * (CORE_HZ / MICROSECONDS);
    uint32_t count = T0TC;
    T0TC = (count > cycles) ? (count - cycles) : 0U;
}

void TIMER0_Handler(void)
{
    T0IR = 1U;
    core_sample();
}

/* ---- UART ---- */

struct baud_setting {
    uint32_t divisor;
    uint32_t fraction; /* FDR: MULVAL in bits 4…7, DIVADDVAL in bits 0…3 */
    uint32_t error;    /* deviation from the wanted rate, baud */
};

/* Divisor and fractional divider that come nearest: baud = CORE_HZ / (16 · divisor · (1 + add / multiplier)). */
static struct baud_setting find_baud(uint32_t baud)
{
    struct baud_setting best = {1U, 0x10U, UINT32_MAX};
    for (uint32_t multiplier = 1U; multiplier <= 15U; multiplier++) {
        for (uint32_t add = 0U; add < multiplier; add++) {
            uint32_t clock = (CORE_HZ / 16U) * multiplier / (multiplier + add);
            uint32_t divisor = (clock + (baud / 2U)) / baud;
            if ((divisor >= 1U) && (divisor <= 0xFFFFU) && ((add == 0U) || (divisor >= 3U))) {
                uint32_t actual = clock / divisor;
                uint32_t error = (actual > baud) ? (actual - baud) : (baud - actual);
                if (error < best.error) {
                    best.divisor = divisor;
                    best.fraction = (multiplier << 4) | add;
                    best.error = error;
                }
            }
        }
    }
    return best;
}

bool hal_baud_possible(uint32_t baud)
{
    return (baud >= BAUD_MIN) && (baud <= (CORE_HZ / 16U)) && (find_baud(baud).error <= (baud / 100U));
}

void hal_set_baud(uint32_t baud)
{
    struct baud_setting setting = find_baud(baud);
    hal_lock(); /* a byte that comes now must not be fetched: the divisor lies in the place of the receiver */
    U0LCR = UART_LCR_DIVISOR | UART_LCR_8N1;
    U0DLL = setting.divisor & 0xFFU;
    U0DLM = setting.divisor >> 8;
    U0FDR = setting.fraction;
    U0LCR = UART_LCR_8N1;
    hal_unlock();
}

static void uart_init(void)
{
    hal_set_baud(GFIMU_BOOT_BAUD);
    U0FCR = 0x07U;
    U0IER = UART_IER_RECEIVE | UART_IER_TRANSMIT | UART_IER_LINE_STATUS;
}

static void fill_transmitter(void)
{
    const uint8_t *bytes;
    uint32_t count = core_transmit_peek(&bytes);
    if (count >= UART_FIFO_BYTES) {
        count = UART_FIFO_BYTES;
        for (uint32_t i = 0U; i < UART_FIFO_BYTES; i++) { /* a constant count: the compiler unrolls this one */
            U0THR = bytes[i];
        }
    } else {
        for (uint32_t i = 0U; i < count; i++) {
            U0THR = bytes[i];
        }
    }
    core_transmit_taken(count);
    transmitting = (count != 0U);
}

void hal_transmit_kick(void)
{
    hal_lock();
    if (!transmitting) {
        fill_transmitter();
    }
    hal_unlock();
}

bool hal_transmit_idle(void)
{
    const uint8_t *bytes;
    return (core_transmit_peek(&bytes) == 0U) && ((U0LSR & UART_LSR_IDLE) != 0U);
}

void UART0_Handler(void)
{
    uint32_t cause = U0IIR;
    if ((cause & UART_IIR_NONE) == 0U) {
        if ((cause & 0x0EU) == 0x02U) {
            hal_lock(); /* a sample between "nothing left" and "not transmitting" would wait for the next one */
            fill_transmitter();
            hal_unlock();
        } else {
            uint32_t line = U0LSR;
            if ((line & UART_LSR_ERRORS) != 0U) {
                core_receive_error();
            }
            while ((line & UART_LSR_READY) != 0U) {
                core_receive((uint8_t)U0RBR);
                line = U0LSR;
            }
        }
    }
}

/* ---- critical sections ---- */

static volatile uint32_t lock_depth;

void hal_lock(void)
{
    interrupts_off();
    lock_depth++;
}

void hal_unlock(void)
{
    lock_depth--;
    if (lock_depth == 0U) {
        interrupts_on();
    }
}

/* ---- main loop ---- */

/* Wakes the main loop, which has nothing else to wake for while no samples are taken. */
static void wake_init(void)
{
    SYSTEM_PRIORITY(EXCEPTION_SYSTICK) = PRIORITY_WAKE << NVIC_PRIORITY_SHIFT;
    SYST_RVR = WAKE_TICKS - 1U;
    SYST_CVR = 0U;
    SYST_CSR = SYST_CSR_ENABLE_INTERRUPT;
}

void SysTick_Handler(void)
{
}

/* Fed while the main loop runs and, when streaming, samples are taken as they should be. */
/* Blinks while the main loop runs: once a second, twice when samples are taken. */
static void led_show(uint32_t now_us)
{
    static uint32_t changed_us;
    static bool is_on;
    if ((now_us - changed_us) >= (core_is_streaming() ? LED_STREAMING_US : LED_IDLE_US)) {
        changed_us = now_us;
        is_on = !is_on;
        if (is_on) {
            FIO1SET = LED_MBED;
            FIO0SET = LED_LPCXPRESSO;
        } else {
            FIO1CLR = LED_MBED;
            FIO0CLR = LED_LPCXPRESSO;
        }
    }
}

static void led_init(void)
{
    FIO1DIR |= LED_MBED;
    FIO0DIR |= LED_LPCXPRESSO;
}

static void watchdog_watch(void)
{
    static uint32_t fed_us;
    static uint32_t seen;
    uint32_t beat = core_heartbeat();
    if (!core_is_streaming() || (beat != seen)) {
        uint32_t now_us = hal_time_us();
        seen = beat;
        if ((now_us - fed_us) >= WATCHDOG_FEED_US) {
            fed_us = now_us;
            watchdog_feed();
        }
        led_show(now_us);
    }
}

int main(void)
{
    hal_lock();
    watchdog_start();
    uint32_t cause = RSID & 0x0FU;
    RSID = cause; /* the flags are cleared by writing ones */
    if (!clock_init()) {
        cause |= RESET_NO_CRYSTAL;
    }
    time_init();
    led_init();
    spi_init();
    uart_init();
    core_init(cause, GFIMU_BOOT_BAUD);
    NVIC_PRIORITY(IRQ_TIMER0) = PRIORITY_SAMPLE << NVIC_PRIORITY_SHIFT;
    NVIC_PRIORITY(IRQ_UART0) = PRIORITY_UART << NVIC_PRIORITY_SHIFT;
    NVIC_ISER0 = 1U << IRQ_UART0;
    wake_init();
    watchdog_feed();
#if GFIMU_AUTOSTART
    core_start();
#endif
    hal_unlock();
    for (;;) {
        core_poll();
        watchdog_watch();
        /* With interrupts off, nothing can arrive between the question and the sleep; a pending one still wakes. */
        interrupts_off();
        if (!core_has_work()) {
            wait_for_interrupt();
        }
        interrupts_on();
    }
    return 0;
}
