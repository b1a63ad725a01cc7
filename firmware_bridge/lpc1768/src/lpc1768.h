/* LPC1768 registers that the firmware uses (user manual UM10360; chapter numbers beside each block). */
#ifndef LPC1768_H
#define LPC1768_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define REGISTER8(address) (*(volatile uint8_t *)(address))

/* System control, 3 and 4 */
#define FLASHCFG REGISTER(0x400FC000U)
#define PLL0CON REGISTER(0x400FC080U)
#define PLL0CFG REGISTER(0x400FC084U)
#define PLL0STAT REGISTER(0x400FC088U)
#define PLL0FEED REGISTER(0x400FC08CU)
#define PCONP REGISTER(0x400FC0C4U)
#define CCLKCFG REGISTER(0x400FC104U)
#define CLKSRCSEL REGISTER(0x400FC10CU)
#define RSID REGISTER(0x400FC180U)
#define SCS REGISTER(0x400FC1A0U)
#define PCLKSEL0 REGISTER(0x400FC1A8U)
#define PCLKSEL1 REGISTER(0x400FC1ACU)

#define SCS_CRYSTAL_ON (1U << 5)
#define SCS_CRYSTAL_READY (1U << 6)
#define CLKSRC_INTERNAL 0U
#define CLKSRC_CRYSTAL 1U
#define PLL0_ENABLE (1U << 0)
#define PLL0_CONNECT (1U << 1)
#define PLL0STAT_ENABLED (1U << 24)
#define PLL0STAT_CONNECTED (1U << 25)
#define PLL0STAT_LOCKED (1U << 26)

#define PCONP_TIMER0 (1U << 1)
#define PCONP_TIMER1 (1U << 2)
#define PCONP_UART0 (1U << 3)
#define PCONP_SSP1 (1U << 10)
#define PCONP_GPIO (1U << 15)

/* Pin connect block, 8 */
#define PINSEL0 REGISTER(0x4002C000U)
#define PINSEL4 REGISTER(0x4002C010U)

/* GPIO, 9 */
#define FIO0DIR REGISTER(0x2009C000U)
#define FIO0SET REGISTER(0x2009C018U)
#define FIO0CLR REGISTER(0x2009C01CU)
#define FIO1DIR REGISTER(0x2009C020U)
#define FIO1SET REGISTER(0x2009C038U)
#define FIO1CLR REGISTER(0x2009C03CU)
#define FIO2DIR REGISTER(0x2009C040U)
#define FIO2SET REGISTER(0x2009C058U)
#define FIO2CLR REGISTER(0x2009C05CU)

/* UART0, 14 */
#define U0RBR REGISTER(0x4000C000U)
#define U0THR REGISTER(0x4000C000U)
#define U0DLL REGISTER(0x4000C000U)
#define U0DLM REGISTER(0x4000C004U)
#define U0IER REGISTER(0x4000C004U)
#define U0IIR REGISTER(0x4000C008U)
#define U0FCR REGISTER(0x4000C008U)
#define U0LCR REGISTER(0x4000C00CU)
#define U0LSR REGISTER(0x4000C014U)
#define U0FDR REGISTER(0x4000C028U)

#define UART_FIFO_BYTES 16U
#define UART_IER_RECEIVE (1U << 0)
#define UART_IER_TRANSMIT (1U << 1)
#define UART_IER_LINE_STATUS (1U << 2)
#define UART_IIR_NONE (1U << 0)
#define UART_LCR_8N1 0x03U
#define UART_LCR_DIVISOR 0x80U
#define UART_LSR_READY (1U << 0)
#define UART_LSR_ERRORS 0x1EU
#define UART_LSR_IDLE (1U << 6)

/* SSP1, 18 */
#define SSP1CR0 REGISTER(0x40030000U)
#define SSP1CR1 REGISTER(0x40030004U)
#define SSP1DR REGISTER(0x40030008U)
#define SSP1SR REGISTER(0x4003000CU)
#define SSP1CPSR REGISTER(0x40030010U)

#define SSP_CR0_16_BIT 0x0FU
#define SSP_CR0_MODE_3 0xC0U
#define SSP_CR0_DIVIDER_SHIFT 8U
#define SSP_CR1_ENABLE (1U << 1)
#define SSP_SR_RECEIVED (1U << 2)
#define SSP_SR_BUSY (1U << 4)

/* TIMER0/1, 21 */
#define T0IR REGISTER(0x40004000U)
#define T0TCR REGISTER(0x40004004U)
#define T0TC REGISTER(0x40004008U)
#define T0PR REGISTER(0x4000400CU)
#define T0MCR REGISTER(0x40004014U)
#define T0MR0 REGISTER(0x40004018U)
#define T1TCR REGISTER(0x40008004U)
#define T1TC REGISTER(0x40008008U)
#define T1PR REGISTER(0x4000800CU)

#define TIMER_ENABLE (1U << 0)
#define TIMER_RESET (1U << 1)
#define TIMER_MR0_INTERRUPT (1U << 0)
#define TIMER_MR0_RESET (1U << 1)

/* Watchdog, 28 */
#define WDMOD REGISTER(0x40000000U)
#define WDTC REGISTER(0x40000004U)
#define WDFEED REGISTER(0x40000008U)
#define WDCLKSEL REGISTER(0x40000010U)
#define WDMOD_ENABLE_RESET 0x03U

/* Cortex-M3 */
#define NVIC_ISER0 REGISTER(0xE000E100U)
#define NVIC_ICER0 REGISTER(0xE000E180U)
#define NVIC_ICPR0 REGISTER(0xE000E280U)
#define NVIC_PRIORITY(irq) REGISTER8(0xE000E400U + (irq))
#define NVIC_PRIORITY_SHIFT 3U
#define SYST_CSR REGISTER(0xE000E010U)
#define SYST_RVR REGISTER(0xE000E014U)
#define SYST_CVR REGISTER(0xE000E018U)
#define SYST_CSR_ENABLE_INTERRUPT 0x07U /* on, with its exception, at the core clock */
#define EXCEPTION_SYSTICK 15U
#define SYSTEM_PRIORITY(exception) REGISTER8(0xE000ED14U + (exception))

#define IRQ_TIMER0 1U
#define IRQ_UART0 5U

/* What was written before holds for every instruction behind it. */
static inline void barrier(void)
{
    __asm volatile("dsb\n\tisb" ::: "memory");
}

static inline void wait_for_interrupt(void)
{
    __asm volatile("wfi" ::: "memory");
}

static inline void interrupts_off(void)
{
    __asm volatile("cpsid i" ::: "memory");
}

static inline void interrupts_on(void)
{
    __asm volatile("cpsie i" ::: "memory");
}

#endif
