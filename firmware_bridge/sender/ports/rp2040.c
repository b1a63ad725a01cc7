/* RP2040 (Raspberry Pi Pico), by its registers (RP2040 data sheet). The pico-sdk does the start: boot stage, clocks, main.
 *
 *     GP0 TX, GP1 RX            UART0, to a USB-serial bridge or the debug probe
 *     GP2 SCK, GP3 MOSI, GP4 MISO   SPI0
 *     GP5…GP8                   chip selects of chips 1…4
 *     GP25                      LED
 */
#include "gfimu_port.h"

#ifndef GFIMU_CLOCK_HZ
#define GFIMU_CLOCK_HZ 125000000U /* clk_sys and clk_peri, as the pico-sdk sets them */
#endif
#define BOOT_BAUD 115200U
#define BAUD_MIN 9600U
#define SPI_PRESCALER 2U
#define SPI_HZ_MAX 5000000U
#define SPI_DIVIDER ((GFIMU_CLOCK_HZ + (SPI_PRESCALER * SPI_HZ_MAX) - 1U) / (SPI_PRESCALER * SPI_HZ_MAX))
#define SPI_FIFO 8U
#define SPI_LOOKS 10000U /* at least 5 cycles each: 0.4 ms, while 16 bytes take 27 µs */
#define SELECT_REST_LOOPS 5U /* of at least 5 cycles: 200 ns */
#define SELECT_FIRST 5U
#define LED (1U << 25)
#define WATCHDOG_TICKS 4000000U /* 2 s: the counter goes down twice a microsecond (erratum RP2040-E1) */

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define CLEAR 0x3000U /* alias of a register that clears the bits written */

#define RESETS_RESET 0x4000C000U
#define RESETS_DONE REGISTER(0x4000C008U)
#define RESETS_USED ((1U << 5) | (1U << 8) | (1U << 16) | (1U << 21) | (1U << 22)) /* pins, pads, SPI0, timer, UART0 */

#define PIN_FUNCTION(pin) REGISTER(0x40014004U + (8U * (pin)))
#define PIN_PAD(pin) REGISTER(0x4001C004U + (4U * (pin)))
#define PAD_DIGITAL 0x56U /* as after reset: input on, Schmitt trigger, 4 mA; the pull-down is taken away */
#define PAD_PULL_DOWN 0x04U
#define FUNCTION_SPI 1U
#define FUNCTION_UART 2U
#define FUNCTION_GPIO 5U
#define GPIO_SET REGISTER(0xD0000014U)
#define GPIO_CLEAR REGISTER(0xD0000018U)
#define GPIO_OUTPUT_SET REGISTER(0xD0000024U)

#define UART_DR REGISTER(0x40034000U)
#define UART_DR_ERRORS 0xF00U
#define UART_FR REGISTER(0x40034018U)
#define UART_FR_RECEIVE_EMPTY 0x10U
#define UART_FR_TRANSMIT_FULL 0x20U
#define UART_FR_BUSY 0x08U
#define UART_IBRD REGISTER(0x40034024U)
#define UART_FBRD REGISTER(0x40034028U)
#define UART_LCR_H REGISTER(0x4003402CU)
#define UART_LCR_H_8N1_FIFO 0x70U
#define UART_CR REGISTER(0x40034030U)
#define UART_CR_ON 0x301U /* transmitter and receiver */

#define SPI_CR0 REGISTER(0x4003C000U)
#define SPI_CR0_MODE_3_8_BIT 0xC7U
#define SPI_CR1 REGISTER(0x4003C004U)
#define SPI_CR1_ENABLE 0x02U
#define SPI_DR REGISTER(0x4003C008U)
#define SPI_SR REGISTER(0x4003C00CU)
#define SPI_SR_RECEIVED 0x04U
#define SPI_SR_BUSY 0x10U
#define SPI_CPSR REGISTER(0x4003C010U)

#define TIMERAWL REGISTER(0x40054028U)

#define WATCHDOG_CTRL REGISTER(0x40058000U)
#define WATCHDOG_ENABLE 0x40000000U
#define WATCHDOG_LOAD REGISTER(0x40058004U)
#define WATCHDOG_REASON REGISTER(0x40058008U)
#define WATCHDOG_REASON_TIMER 1U
#define WATCHDOG_RESETS REGISTER(0x40010008U)
#define WATCHDOG_RESETS_ALL 0x1FFFCU /* but the oscillators */
#define CHIP_RESET REGISTER(0x40064008U)
#define CHIP_RESET_POWER_ON 0x100U
#define CHIP_RESET_RUN_PIN 0x10000U

/* ---- SPI ---- */

static void spi_init(void)
{
    for (uint32_t pin = 2U; pin <= 4U; pin++) {
        PIN_PAD(pin) = PAD_DIGITAL & ~PAD_PULL_DOWN;
        PIN_FUNCTION(pin) = FUNCTION_SPI;
    }
    for (uint32_t pin = SELECT_FIRST; pin < (SELECT_FIRST + GFIMU_CHIPS); pin++) {
        PIN_PAD(pin) = PAD_DIGITAL & ~PAD_PULL_DOWN;
        GPIO_SET = 1U << pin;
        GPIO_OUTPUT_SET = 1U << pin;
        PIN_FUNCTION(pin) = FUNCTION_GPIO;
    }
    SPI_CR1 = 0U;
    SPI_CPSR = SPI_PRESCALER;
    SPI_CR0 = SPI_CR0_MODE_3_8_BIT | ((SPI_DIVIDER - 1U) << 8);
    SPI_CR1 = SPI_CR1_ENABLE;
}

/* After an exchange that did not end: no byte may be left for the next one. */
static void spi_recover(void)
{
    SPI_CR1 = 0U;
    for (uint32_t i = 0U; (i < SPI_FIFO) && ((SPI_SR & SPI_SR_RECEIVED) != 0U); i++) {
        (void)SPI_DR;
    }
    SPI_CR1 = SPI_CR1_ENABLE;
}

void gfimu_port_exchange(uint8_t chip, uint8_t *bytes, uint8_t count)
{
    uint32_t sent = 0U;
    uint32_t received = 0U;
    uint32_t looks = SPI_LOOKS;
    GPIO_CLEAR = 1U << (SELECT_FIRST + chip);
    while ((received < count) && (looks > 0U)) {
        if ((sent < count) && ((sent - received) < SPI_FIFO)) {
            SPI_DR = bytes[sent];
            sent++;
        }
        if ((SPI_SR & SPI_SR_RECEIVED) != 0U) {
            bytes[received] = (uint8_t)SPI_DR;
            received++;
        }
        looks--;
    }
    while (((SPI_SR & SPI_SR_BUSY) != 0U) && (looks > 0U)) { /* half a clock, until SCK is back at rest */
        looks--;
    }
    GPIO_SET = 1U << (SELECT_FIRST + chip);
    if (received < count) {
        spi_recover();
        for (uint32_t i = 0U; i < count; i++) {
            bytes[i] = UINT8_MAX;
        }
    }
    for (volatile uint32_t i = 0U; i < SELECT_REST_LOOPS; i++) {
    }
}

uint32_t gfimu_port_spi_khz(void)
{
    return GFIMU_CLOCK_HZ / (SPI_PRESCALER * SPI_DIVIDER) / 1000U;
}

/* ---- time ---- */

uint32_t gfimu_port_time_us(void)
{
    return TIMERAWL;
}

/* ---- UART: its FIFOs hold 32 bytes each way ---- */

/* 64 times the divisor: baud = clock / (16 · divisor). */
static uint32_t divisor_64(uint32_t baud)
{
    return ((4U * GFIMU_CLOCK_HZ) + (baud / 2U)) / baud;
}

bool gfimu_port_baud_possible(uint32_t baud)
{
    if ((baud < BAUD_MIN) || (baud > (GFIMU_CLOCK_HZ / 16U))) {
        return false;
    }
    uint32_t actual = (4U * GFIMU_CLOCK_HZ) / divisor_64(baud);
    return ((actual > baud) ? (actual - baud) : (baud - actual)) <= (baud / 100U);
}

void gfimu_port_set_baud(uint32_t baud)
{
    UART_CR = 0U;
    UART_IBRD = divisor_64(baud) / 64U;
    UART_FBRD = divisor_64(baud) % 64U;
    UART_LCR_H = UART_LCR_H_8N1_FIFO; /* takes over the divisors */
    UART_CR = UART_CR_ON;
}

uint32_t gfimu_port_write(const uint8_t *bytes, uint32_t count)
{
    uint32_t taken = 0U;
    while ((taken < count) && ((UART_FR & UART_FR_TRANSMIT_FULL) == 0U)) {
        UART_DR = bytes[taken];
        taken++;
    }
    return taken;
}

bool gfimu_port_write_idle(void)
{
    return (UART_FR & UART_FR_BUSY) == 0U;
}

int16_t gfimu_port_read(void)
{
    if ((UART_FR & UART_FR_RECEIVE_EMPTY) != 0U) {
        return GFIMU_NOTHING;
    }
    uint32_t data = UART_DR;
    return ((data & UART_DR_ERRORS) != 0U) ? GFIMU_DAMAGED : (int16_t)(data & 0xFFU);
}

/* ---- start, watchdog, LED ---- */

static uint32_t reset_cause(void)
{
    uint32_t cause = 0U;
    if ((WATCHDOG_REASON & WATCHDOG_REASON_TIMER) != 0U) {
        cause |= GFIMU_RESET_WATCHDOG;
    } else {
        cause |= ((CHIP_RESET & CHIP_RESET_POWER_ON) != 0U) ? GFIMU_RESET_POWER_ON : 0U;
        cause |= ((CHIP_RESET & CHIP_RESET_RUN_PIN) != 0U) ? GFIMU_RESET_EXTERNAL : 0U;
    }
    return cause;
}

static void watchdog_start(void)
{
    WATCHDOG_RESETS = WATCHDOG_RESETS_ALL;
    WATCHDOG_LOAD = WATCHDOG_TICKS;
    WATCHDOG_CTRL = WATCHDOG_ENABLE;
}

void gfimu_port_alive(bool light)
{
    WATCHDOG_LOAD = WATCHDOG_TICKS;
    if (light) {
        GPIO_SET = LED;
    } else {
        GPIO_CLEAR = LED;
    }
}

int main(void)
{
    uint32_t cause = reset_cause();
    watchdog_start(); /* before anything that is waited for */
    REGISTER(RESETS_RESET + CLEAR) = RESETS_USED;
    while ((RESETS_DONE & RESETS_USED) != RESETS_USED) {
    }
    PIN_FUNCTION(25U) = FUNCTION_GPIO;
    GPIO_OUTPUT_SET = LED;
    PIN_FUNCTION(0U) = FUNCTION_UART;
    PIN_FUNCTION(1U) = FUNCTION_UART;
    gfimu_port_set_baud(BOOT_BAUD);
    spi_init();
    gfimu_sender_begin(cause, BOOT_BAUD);
    for (;;) {
        gfimu_sender_step();
    }
}
