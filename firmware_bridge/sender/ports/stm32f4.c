/* STM32F401, F405, F407 and F411 (Black Pill), by their registers (RM0383, RM0090), with startup code of its own.
 *
 *     PA9 TX, PA10 RX           USART1, to a USB-serial bridge
 *     PA5 SCK, PA6 MISO, PA7 MOSI   SPI1
 *     PB12…PB15                 chip selects of chips 1…4
 *     PC13                      LED (lit when low)
 */
#include "gfimu_port.h"

#ifndef GFIMU_CRYSTAL_MHZ
#define GFIMU_CRYSTAL_MHZ 25U /* Black Pill; 8 on Nucleo and Discovery boards */
#endif
#define CRYSTAL_CLOCK_HZ 80000000U
#define INTERNAL_CLOCK_HZ 16000000U /* ± 1 %, if the crystal does not start */
#define MICROSECONDS 1000000U
#define CLOCK_LOOKS 50000U /* of at least 4 cycles each: 12 ms at 16 MHz; crystals start within 2 ms as a rule */
#define SPI_LOOKS 5000U    /* of at least 4 cycles each: 0.25 ms, while 16 bytes take 32 µs */
#define SELECT_REST_LOOPS 5U /* of at least 5 cycles: 300 ns at 80 MHz */
#define SELECT_FIRST 12U
#define BOOT_BAUD 115200U
#define BAUD_MIN 9600U
#define RECEIVE_RING 64U  /* powers of two */
#define TRANSMIT_RING 256U
#define LED (1U << 13)
#define WATCHDOG_MS 2000U

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define RCC_CR REGISTER(0x40023800U)
#define RCC_CR_CRYSTAL_ON (1U << 16)
#define RCC_CR_CRYSTAL_READY (1U << 17)
#define RCC_CR_PLL_ON (1U << 24)
#define RCC_CR_PLL_READY (1U << 25)
#define RCC_PLLCFGR REGISTER(0x40023804U)
#define RCC_PLLCFGR_80_MHZ (GFIMU_CRYSTAL_MHZ | (320U << 6) | (1U << 16) | (1U << 22) | (7U << 24)) /* 1 MHz × 320 / 4 */
#define RCC_CFGR REGISTER(0x40023808U)
#define RCC_CFGR_PLL_APB1_HALF 0x1002U
#define RCC_CFGR_RUNS_FROM_PLL 0x08U
#define RCC_CFGR_RUNS_FROM 0x0CU
#define RCC_AHB1ENR REGISTER(0x40023830U)
#define RCC_AHB1ENR_PORTS_A_B_C 0x07U
#define RCC_APB1ENR REGISTER(0x40023840U)
#define RCC_APB1ENR_TIM5 (1U << 3)
#define RCC_APB2ENR REGISTER(0x40023844U)
#define RCC_APB2ENR_USART1_SPI1 ((1U << 4) | (1U << 12))
#define RCC_CSR REGISTER(0x40023874U)
#define RCC_CSR_FORGET (1U << 24)
#define RCC_CSR_BROWN_OUT (1U << 25)
#define RCC_CSR_PIN (1U << 26)
#define RCC_CSR_POWER_ON (1U << 27)
#define RCC_CSR_WATCHDOG (1U << 29)
#define FLASH_ACR REGISTER(0x40023C00U)
#define FLASH_ACR_80_MHZ 0x702U /* 2 wait states, caches and prefetch on */

#define GPIOA 0x40020000U
#define GPIOB 0x40020400U
#define GPIOC 0x40020800U
#define GPIO_MODE(port) REGISTER((port) + 0x00U)
#define GPIO_PULL(port) REGISTER((port) + 0x0CU)
#define GPIO_SET(port) REGISTER((port) + 0x18U) /* the upper half clears */
#define GPIO_FUNCTION_LOW(port) REGISTER((port) + 0x20U)
#define GPIO_FUNCTION_HIGH(port) REGISTER((port) + 0x24U)

#define SPI_CR1 REGISTER(0x40013000U)
#define SPI_CR1_MASTER_MODE_3 0x347U /* MSTR, SPE, SSI, SSM, CPOL, CPHA */
#define SPI_CR1_ENABLE 0x40U
#define SPI_CR1_DIVIDER_SHIFT 3U
#define SPI_SR REGISTER(0x40013008U)
#define SPI_SR_RECEIVED 0x01U
#define SPI_SR_BUSY 0x80U
#define SPI_DR REGISTER(0x4001300CU)

#define USART_SR REGISTER(0x40011000U)
#define USART_SR_ERRORS 0x0EU /* framing, noise, overrun */
#define USART_SR_RECEIVED 0x20U
#define USART_SR_IDLE 0x40U
#define USART_SR_TAKES 0x80U
#define USART_DR REGISTER(0x40011004U)
#define USART_BRR REGISTER(0x40011008U)
#define USART_CR1 REGISTER(0x4001100CU)
#define USART_CR1_ON 0x202CU /* UE, RXNEIE, TE, RE */
#define USART_CR1_TRANSMIT_INTERRUPT 0x80U

#define TIM5_CR1 REGISTER(0x40000C00U)
#define TIM5_EGR REGISTER(0x40000C14U)
#define TIM5_CNT REGISTER(0x40000C24U)
#define TIM5_PSC REGISTER(0x40000C28U)
#define TIM5_ARR REGISTER(0x40000C2CU)

#define IWDG_KR REGISTER(0x40003000U)
#define IWDG_PR REGISTER(0x40003004U)
#define IWDG_PR_32 3U /* 32 kHz / 32: a tick a millisecond */
#define IWDG_RLR REGISTER(0x40003008U)
#define IWDG_SR REGISTER(0x4000300CU)
#define IWDG_START 0xCCCCU
#define IWDG_UNLOCK 0x5555U
#define IWDG_FEED 0xAAAAU

#define IRQ_USART1 37U
#define NVIC_ISER1 REGISTER(0xE000E104U)

static uint32_t clock_hz;

/* ---- clocks ---- */

static bool await(volatile uint32_t *place, uint32_t mask, uint32_t value)
{
    uint32_t looks = CLOCK_LOOKS;
    while (((*place & mask) != value) && (looks > 0U)) {
        looks--;
    }
    return looks > 0U;
}

/* 80 MHz from the crystal; the internal oscillator if it or the PLL does not start. Flash gets its wait states first. */
static void clock_init(void)
{
    clock_hz = INTERNAL_CLOCK_HZ;
    RCC_CR |= RCC_CR_CRYSTAL_ON;
    if (await(&RCC_CR, RCC_CR_CRYSTAL_READY, RCC_CR_CRYSTAL_READY)) {
        RCC_PLLCFGR = RCC_PLLCFGR_80_MHZ;
        RCC_CR |= RCC_CR_PLL_ON;
        if (await(&RCC_CR, RCC_CR_PLL_READY, RCC_CR_PLL_READY)) {
            FLASH_ACR = FLASH_ACR_80_MHZ;
            RCC_CFGR = RCC_CFGR_PLL_APB1_HALF; /* the timers of APB1 run at twice its clock: 80 MHz again */
            if (await(&RCC_CFGR, RCC_CFGR_RUNS_FROM, RCC_CFGR_RUNS_FROM_PLL)) {
                clock_hz = CRYSTAL_CLOCK_HZ;
            }
        }
    }
    RCC_AHB1ENR |= RCC_AHB1ENR_PORTS_A_B_C;
    RCC_APB1ENR |= RCC_APB1ENR_TIM5;
    RCC_APB2ENR |= RCC_APB2ENR_USART1_SPI1;
    (void)RCC_APB2ENR; /* a peripheral needs two cycles to begin */
}

static void time_init(void)
{
    TIM5_PSC = (clock_hz / MICROSECONDS) - 1U;
    TIM5_ARR = UINT32_MAX;
    TIM5_EGR = 1U; /* takes over the prescaler */
    TIM5_CR1 = 1U;
}

uint32_t gfimu_port_time_us(void)
{
    return TIM5_CNT;
}

/* ---- pins ---- */

/* Modes: 1 output, 2 alternate function; two bits a pin. */
static void pin_mode(uint32_t port, uint32_t pin, uint32_t mode)
{
    GPIO_MODE(port) = (GPIO_MODE(port) & ~(3U << (2U * pin))) | (mode << (2U * pin));
}

static void pins_init(void)
{
    GPIO_FUNCTION_LOW(GPIOA) = (GPIO_FUNCTION_LOW(GPIOA) & 0x000FFFFFU) | 0x55500000U; /* SPI1 */
    GPIO_FUNCTION_HIGH(GPIOA) = (GPIO_FUNCTION_HIGH(GPIOA) & ~0xFF0U) | 0x770U;        /* USART1 */
    GPIO_PULL(GPIOA) = (GPIO_PULL(GPIOA) & ~(3U << 20)) | (1U << 20); /* RX rests high without a cable */
    for (uint32_t pin = 5U; pin <= 10U; pin++) {
        if (pin != 8U) {
            pin_mode(GPIOA, pin, 2U);
        }
    }
    for (uint32_t pin = SELECT_FIRST; pin < (SELECT_FIRST + GFIMU_CHIPS); pin++) {
        GPIO_SET(GPIOB) = 1U << pin;
        pin_mode(GPIOB, pin, 1U);
    }
    pin_mode(GPIOC, 13U, 1U);
}

/* ---- SPI ---- */

static uint32_t spi_divider(void)
{
    return (clock_hz == CRYSTAL_CLOCK_HZ) ? 3U : 1U; /* 80 MHz / 16 = 5 MHz; 16 MHz / 4 = 4 MHz */
}

static void spi_init(void)
{
    SPI_CR1 = (SPI_CR1_MASTER_MODE_3 & ~SPI_CR1_ENABLE) | (spi_divider() << SPI_CR1_DIVIDER_SHIFT);
    SPI_CR1 |= SPI_CR1_ENABLE;
}

void gfimu_port_exchange(uint8_t chip, uint8_t *bytes, uint8_t count)
{
    uint32_t looks = SPI_LOOKS;
    uint32_t done = 0U;
    GPIO_SET(GPIOB) = 1U << (SELECT_FIRST + 16U + chip);
    while ((done < count) && (looks > 0U)) {
        SPI_DR = bytes[done];
        while (((SPI_SR & SPI_SR_RECEIVED) == 0U) && (looks > 0U)) {
            looks--;
        }
        bytes[done] = (uint8_t)SPI_DR;
        done++;
    }
    while (((SPI_SR & SPI_SR_BUSY) != 0U) && (looks > 0U)) {
        looks--;
    }
    GPIO_SET(GPIOB) = 1U << (SELECT_FIRST + chip);
    if (looks == 0U) {
        spi_init();
        for (uint32_t i = 0U; i < count; i++) {
            bytes[i] = UINT8_MAX;
        }
    }
    for (volatile uint32_t i = 0U; i < SELECT_REST_LOOPS; i++) {
    }
}

uint32_t gfimu_port_spi_khz(void)
{
    return clock_hz / (2U << spi_divider()) / 1000U;
}

/* ---- USART: it has no FIFO, so an interrupt keeps what comes while a sample is taken, and sends ---- */

static volatile uint8_t receive_ring[RECEIVE_RING];
static volatile uint32_t receive_head;
static volatile uint32_t receive_tail;
static volatile bool damaged;
static volatile uint8_t transmit_ring[TRANSMIT_RING];
static volatile uint32_t transmit_head;
static volatile uint32_t transmit_tail;

void USART1_Handler(void);

void USART1_Handler(void)
{
    uint32_t status = USART_SR;
    if ((status & (USART_SR_RECEIVED | USART_SR_ERRORS)) != 0U) {
        uint8_t byte = (uint8_t)USART_DR; /* clears the flags */
        uint32_t next = (receive_head + 1U) % RECEIVE_RING;
        if (((status & USART_SR_ERRORS) != 0U) || (next == receive_tail)) {
            damaged = true;
        } else {
            receive_ring[receive_head] = byte;
            receive_head = next;
        }
    }
    if ((status & USART_SR_TAKES) != 0U) {
        if (transmit_tail != transmit_head) {
            USART_DR = transmit_ring[transmit_tail];
            transmit_tail = (transmit_tail + 1U) % TRANSMIT_RING;
        } else {
            USART_CR1 = USART_CR1_ON;
        }
    }
}

uint32_t gfimu_port_write(const uint8_t *bytes, uint32_t count)
{
    uint32_t taken = 0U;
    uint32_t next = (transmit_head + 1U) % TRANSMIT_RING;
    while ((taken < count) && (next != transmit_tail)) {
        transmit_ring[transmit_head] = bytes[taken];
        transmit_head = next;
        next = (next + 1U) % TRANSMIT_RING;
        taken++;
    }
    USART_CR1 = USART_CR1_ON | USART_CR1_TRANSMIT_INTERRUPT;
    return taken;
}

bool gfimu_port_write_idle(void)
{
    return (transmit_tail == transmit_head) && ((USART_SR & USART_SR_IDLE) != 0U);
}

int16_t gfimu_port_read(void)
{
    int16_t found = GFIMU_NOTHING;
    if (receive_tail != receive_head) {
        found = (int16_t)receive_ring[receive_tail];
        receive_tail = (receive_tail + 1U) % RECEIVE_RING;
    } else if (damaged) {
        damaged = false;
        found = GFIMU_DAMAGED;
    }
    return found;
}

static uint32_t divisor(uint32_t baud)
{
    return (clock_hz + (baud / 2U)) / baud; /* 16 samples a bit: BRR is the whole divisor */
}

bool gfimu_port_baud_possible(uint32_t baud)
{
    if ((baud < BAUD_MIN) || (baud > (clock_hz / 16U))) {
        return false;
    }
    uint32_t actual = clock_hz / divisor(baud);
    return ((actual > baud) ? (actual - baud) : (baud - actual)) <= (baud / 100U);
}

void gfimu_port_set_baud(uint32_t baud)
{
    USART_CR1 = 0U;
    USART_BRR = divisor(baud);
    USART_CR1 = USART_CR1_ON;
}

/* ---- start, watchdog, LED ---- */

static uint32_t reset_cause(void)
{
    uint32_t flags = RCC_CSR;
    uint32_t cause = 0U;
    if ((flags & RCC_CSR_POWER_ON) != 0U) { /* sets the flags of pin and brown-out, too */
        cause = GFIMU_RESET_POWER_ON;
    } else if ((flags & RCC_CSR_BROWN_OUT) != 0U) {
        cause = GFIMU_RESET_BROWN_OUT;
    } else if ((flags & RCC_CSR_WATCHDOG) != 0U) {
        cause = GFIMU_RESET_WATCHDOG;
    } else if ((flags & RCC_CSR_PIN) != 0U) {
        cause = GFIMU_RESET_EXTERNAL;
    }
    RCC_CSR = flags | RCC_CSR_FORGET;
    return cause;
}

static void watchdog_start(void)
{
    IWDG_KR = IWDG_START;
    IWDG_KR = IWDG_UNLOCK;
    IWDG_PR = IWDG_PR_32;
    IWDG_RLR = WATCHDOG_MS;
    (void)await(&IWDG_SR, 3U, 0U);
    IWDG_KR = IWDG_FEED;
}

void gfimu_port_alive(bool light)
{
    IWDG_KR = IWDG_FEED;
    GPIO_SET(GPIOC) = light ? (LED << 16) : LED;
}

int main(void);

int main(void)
{
    uint32_t cause = reset_cause();
    watchdog_start();
    clock_init();
    time_init();
    pins_init();
    spi_init();
    gfimu_port_set_baud(BOOT_BAUD);
    NVIC_ISER1 = 1U << (IRQ_USART1 - 32U);
    gfimu_sender_begin(cause | ((clock_hz == INTERNAL_CLOCK_HZ) ? GFIMU_RESET_NO_CRYSTAL : 0U), BOOT_BAUD);
    for (;;) {
        gfimu_sender_step();
    }
}

/* ---- startup; the symbols are those of stm32f4.ld ---- */

extern uint32_t data_begin;
extern uint32_t data_end;
extern const uint32_t data_image;
extern uint32_t bss_begin;
extern uint32_t bss_end;
extern uint32_t stack_top;

void Reset_Handler(void);

void Reset_Handler(void)
{
    const uint32_t *from = &data_image;
    for (uint32_t *to = &data_begin; to < &data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = &bss_begin; to < &bss_end; to++) {
        *to = 0U;
    }
    (void)main();
}

/* Whatever is not expected ends in the watchdog's reset. */
static void unexpected(void)
{
    for (;;) {
    }
}

typedef void (*handler)(void);

__attribute__((section(".vectors"), used)) static const handler vectors[16U + IRQ_USART1 + 1U] = {
    (handler)(uintptr_t)&stack_top, Reset_Handler, unexpected, unexpected, unexpected, unexpected, unexpected,
    [16U + IRQ_USART1] = USART1_Handler,
};
