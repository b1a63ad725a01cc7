/* The hot half of the emulated board in C: run loop, exceptions, NVIC, SysTick, timers, UARTs, SSPs, GPIO, ADXL345.
 *
 * A translation, function by function, of the Python modules of the same names, which are the reference; the tests
 * compare the two bit by bit. Everything else (clock tree, watchdog, I2C and so on) stays in Python and is reached
 * through call-backs. Unicorn is reached through function pointers, so this file links against nothing but libc.
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define PUBLIC __declspec(dllexport)
#else
#define PUBLIC __attribute__((visibility("default")))
#endif

typedef int64_t ticks;

#define NEVER ((ticks)1 << 62)
#define TICKS_PER_SECOND 14400000000LL

enum { SENSORS = 4, TIMERS = 4, UARTS = 4, SSPS = 2, PORTS = 5, SLOTS = 64, BLOCK = 256 };

/* ---- what Python provides ---- */

struct unicorn {
    int (*reg_read)(void *, int, void *);
    int (*reg_write)(void *, int, const void *);
    int (*reg_read_batch)(void *, int *, void **, int);
    int (*reg_write_batch)(void *, int *, void *const *, int);
    int (*emu_start)(void *, uint64_t, uint64_t, uint64_t, size_t);
    int (*emu_stop)(void *);
    int (*mmio_map)(void *, uint64_t, size_t, void *, void *, void *, void *);
    int (*hook_add)(void *, size_t *, int, void *, void *, uint64_t, uint64_t, ...);
};

/* Register numbers of Unicorn, in the order of enum reg. */
enum reg { R0, R1, R2, R3, R12, LR, XPSR, SP, CONTROL, PC, PRIMASK, BASEPRI, FAULTMASK, MSP, PSP, REG_COUNT };

struct callbacks {
    uint32_t (*read)(int32_t slot, uint32_t offset, uint32_t size);
    void (*write)(int32_t slot, uint32_t offset, uint32_t value, uint32_t size);
    void (*event)(int32_t slot);
    void (*conversions)(int32_t sensor, ticks first, ticks period, int32_t count, uint32_t bw_rate, int32_t *out);
    void (*pins)(int32_t port, uint32_t changed, uint32_t levels);
};

/* What both sides read and write; mirrored by native.Shared. */
struct shared {
    ticks now, until, alarm, limit, cycle, access_ticks;
    int64_t accesses, exceptions;
    int32_t reset_requested; /* -1, or the cause */
    int32_t sleeping;
    int32_t gpio_watching;
    uint32_t pc;
    uint32_t vtor;
    int32_t active_exception;
};

/* ---- peripherals ---- */

struct adxl345 {
    uint8_t registers[64];
    uint8_t events;
    int32_t fifo[33][3];
    int fifo_count;
    bool converting;
    ticks next_conversion, period, pop_done;
    bool triggered, data_ready, overrun, selected, reading;
    int32_t out[3];
    int shown;
    int32_t block[BLOCK][3];
    int block_count, block_place;
    int command; /* -1: none */
    int address;
    double clock_error, phase;
    int32_t self_test[3];
    int wires, stuck_range, line_fault;
    /* events.py */
    bool asleep, signalling, stepwise;
    bool activity_on, inactivity_on, tap_on, free_fall_on, awaits_inactivity, has_activity_reference,
        has_inactivity_reference, quiet;
    int32_t activity_reference[3], inactivity_reference[3];
    ticks quiet_since, second, next_undecimated, undecimated_period;
    int64_t falling, tap_count;
    int tap;
    uint32_t tap_axes;
    int32_t fine[BLOCK][3];
    int fine_count, fine_place;
};

struct timer {
    int slot, irq;
    ticks divider;
    uint32_t interrupts, control, prescale, match_control, match[4];
    uint32_t start_count;
    ticks start, tick, due;
    int due_match;
    uint32_t stored[64];
};

struct line_byte {
    ticks when;
    uint8_t byte, errors;
};

struct uart {
    int slot, irq;
    ticks divider;
    uint32_t divisor, fraction, interrupt_enable, line_control, fifo_control, scratch, errors;
    struct line_byte receiver[16];
    int received;
    struct line_byte *on_line;
    size_t line_head, line_count, line_capacity;
    ticks sent_end, character, lone_byte, empty_at, timeout_at, planned;
    bool empty_pending, timeout;
    uint8_t *sent;
    ticks *sent_at;
    size_t sent_count, sent_capacity;
};

struct ssp {
    int slot, irq;
    ticks divider;
    uint32_t control0, control1, mask, raw, prescaler;
    ticks through[16];
    uint16_t answer[16];
    int words;
    ticks done, bit;
    uint32_t bits;
    int selected; /* sensor, -1: none */
};

struct region {
    struct board *board;
    int slot;
    uint32_t (*read)(struct board *, int, uint32_t, uint32_t);
    void (*write)(struct board *, int, uint32_t, uint32_t, uint32_t);
    int index;
};

struct board {
    struct shared shared;
    void *uc;
    struct unicorn api;
    struct callbacks call;
    int ids[REG_COUNT];
    uint8_t *flash, *ram, *ahb;
    uint32_t flash_size, ram_base, ram_size, ahb_base, ahb_size;
    ticks events[SLOTS];
    int slots;
    int64_t polled_access;
    int polled_slot;
    bool stopped, exception_return, supervisor_call;
    uint32_t returned_to;
    int intr_error, next_exception;
    /* NVIC */
    uint64_t enabled, pending, lines, active_mask;
    int active[64];
    int active_count;
    int priority[64];
    uint32_t group_mask, priority_group;
    uint32_t scb_stored[1024];
    /* SysTick */
    int systick_slot;
    uint32_t st_control, st_reload, st_flag;
    ticks st_wrap, st_stopped_at;
    struct timer timers[TIMERS];
    struct uart uarts[UARTS];
    struct ssp ssps[SSPS];
    /* GPIO */
    uint32_t direction[PORTS], mask[PORTS], latch[PORTS], driven[PORTS], levels[PORTS];
    struct adxl345 sensors[SENSORS];
    int sensor_count;
    int chip_pins_slot;
    int pin_level[SENSORS][2]; /* -1: not driven yet */
    struct region regions[SLOTS];
    int region_count;
};

enum { NMI = 2, HARD_FAULT = 3, SVCALL = 11, PENDSV = 14, SYSTICK = 15, FIRST_IRQ = 16, EXCEPTIONS = 51 };
#define THREAD_PRIORITY 256
#define EXISTING (((uint64_t)1 << EXCEPTIONS) - 1)

static ticks earlier(ticks a, ticks b) { return a < b ? a : b; }
static ticks later(ticks a, ticks b) { return a > b ? a : b; }

/* ---- time and events (board.py) ---- */

static ticks first_event(struct board *b)
{
    ticks first = NEVER;
    for (int k = 0; k < b->slots; k++)
        first = earlier(first, b->events[k]);
    return first;
}

static void schedule(struct board *b, int slot, ticks when)
{
    struct shared *s = &b->shared;
    ticks before = b->events[slot];
    b->events[slot] = when;
    if (when < s->until) {
        s->until = when;
        s->alarm = earlier(s->alarm, when);
    } else if (before == s->until) {
        s->until = first_event(b);
    }
}

static void slot_event(struct board *b, int slot);

static void service(struct board *b)
{
    struct shared *s = &b->shared;
    while (s->until <= s->now) {
        int slot = 0;
        while (b->events[slot] != s->until)
            slot++;
        b->events[slot] = NEVER;
        slot_event(b, slot);
        s->until = first_event(b);
    }
    s->alarm = -1;
}

static bool spinning(struct board *b, int slot)
{
    int last_slot = b->polled_slot;
    int64_t last_access = b->polled_access;
    b->polled_slot = slot;
    b->polled_access = b->shared.accesses;
    return slot == last_slot && b->shared.accesses == last_access + 1;
}

static void wait_until(struct board *b, ticks when)
{
    struct shared *s = &b->shared;
    s->now = later(s->now, earlier(when, s->until));
    if (s->now >= s->until)
        service(b);
}

/* ---- nvic.py ---- */

static void pend(struct board *b, int exception)
{
    b->pending |= (uint64_t)1 << exception;
    b->shared.alarm = -1;
}

static void set_line(struct board *b, int irq, bool level)
{
    uint64_t bit = (uint64_t)1 << (FIRST_IRQ + irq);
    if (level) {
        if (!(b->lines & bit)) {
            b->lines |= bit;
            if (!(b->active_mask & bit))
                pend(b, FIRST_IRQ + irq);
        }
    } else {
        b->lines &= ~bit;
    }
}

static int group(struct board *b, int exception)
{
    int priority = b->priority[exception];
    return priority > 0 ? (int)((uint32_t)priority & b->group_mask) : priority;
}

static int best_exception(struct board *b)
{
    uint64_t waiting = b->pending & b->enabled;
    int best = 0;
    while (waiting) {
        int number = __builtin_ctzll(waiting);
        waiting &= waiting - 1;
        if (!best || b->priority[number] < b->priority[best])
            best = number;
    }
    int running = b->active_count ? group(b, b->active[b->active_count - 1]) : THREAD_PRIORITY;
    return best && group(b, best) < running ? best : 0;
}

static uint32_t reg_get(struct board *b, enum reg which)
{
    uint32_t value = 0;
    b->api.reg_read(b->uc, b->ids[which], &value);
    return value;
}

static void reg_set(struct board *b, enum reg which, uint32_t value)
{
    b->api.reg_write(b->uc, b->ids[which], &value);
}

static bool held_back(struct board *b, int exception)
{
    int priority = group(b, exception);
    if (priority < 0)
        return false;
    if ((reg_get(b, PRIMASK) & 1) || (reg_get(b, FAULTMASK) & 1))
        return true;
    uint32_t base = reg_get(b, BASEPRI) & b->group_mask;
    return base && (uint32_t)priority >= base;
}

static uint32_t priorities(struct board *b, int first)
{
    uint32_t value = 0;
    for (int k = 0; k < 4; k++)
        value |= (uint32_t)(b->priority[first + k] & 0xFF) << 8 * k;
    return value;
}

static void set_priorities(struct board *b, int first, uint32_t value, uint32_t size)
{
    for (uint32_t k = 0; k < size; k++)
        if (first + (int)k != NMI && first + (int)k != HARD_FAULT)
            b->priority[first + k] = value >> 8 * k & 0xF8;
}

static uint32_t interrupt_state(struct board *b)
{
    uint64_t waiting = b->pending & b->enabled;
    int best = 0;
    for (int n = 1; n < EXCEPTIONS; n++)
        if (waiting >> n & 1 && (!best || b->priority[n] < b->priority[best]))
            best = n;
    return (uint32_t)(b->active_count ? b->active[b->active_count - 1] : 0) | (uint32_t)(b->active_count == 1) << 11 |
           (uint32_t)best << 12 | (uint32_t)((waiting >> FIRST_IRQ) != 0) << 22 |
           (uint32_t)(b->pending >> SYSTICK & 1) << 26 | (uint32_t)(b->pending >> PENDSV & 1) << 28 |
           (uint32_t)(b->pending >> NMI & 1) << 31;
}

static uint32_t systick_read(struct board *b, uint32_t offset);
static void systick_write(struct board *b, uint32_t offset, uint32_t value);

static uint32_t nvic_read(struct board *b, int index, uint32_t offset, uint32_t size)
{
    (void)index;
    if (size != 4) {
        uint32_t whole = nvic_read(b, 0, offset & ~3U, 4);
        return whole >> 8 * (offset & 3) & ((1U << 8 * size) - 1);
    }
    if (offset >= 0x10 && offset < 0x20)
        return systick_read(b, offset);
    if (offset >= 0x100 && offset < 0x108)
        return (uint32_t)(b->enabled >> (FIRST_IRQ + 8 * (offset - 0x100)));
    if (offset >= 0x180 && offset < 0x188)
        return (uint32_t)(b->enabled >> (FIRST_IRQ + 8 * (offset - 0x180)));
    if (offset >= 0x200 && offset < 0x208)
        return (uint32_t)(b->pending >> (FIRST_IRQ + 8 * (offset - 0x200)));
    if (offset >= 0x280 && offset < 0x288)
        return (uint32_t)(b->pending >> (FIRST_IRQ + 8 * (offset - 0x280)));
    if (offset >= 0x300 && offset < 0x308)
        return (uint32_t)(b->active_mask >> (FIRST_IRQ + 8 * (offset - 0x300)));
    if (offset >= 0x400 && offset < 0x424)
        return priorities(b, FIRST_IRQ + (int)offset - 0x400);
    if (offset >= 0xD18 && offset < 0xD24)
        return priorities(b, 4 + (int)offset - 0xD18);
    switch (offset) {
    case 0x004: return 1;
    case 0xD00: return 0x412FC230;
    case 0xD04: return interrupt_state(b);
    case 0xD08: return b->shared.vtor;
    case 0xD0C: return 0xFA050000 | b->priority_group << 8;
    default: return b->scb_stored[offset >> 2 & 1023];
    }
}

static void nvic_write(struct board *b, int index, uint32_t offset, uint32_t value, uint32_t size)
{
    (void)index;
    uint64_t wide = value;
    if (offset >= 0x400 && offset < 0x424) {
        set_priorities(b, FIRST_IRQ + (int)offset - 0x400, value, size);
    } else if (offset >= 0xD18 && offset < 0xD24) {
        set_priorities(b, 4 + (int)offset - 0xD18, value, size);
    } else if (offset >= 0x10 && offset < 0x20) {
        systick_write(b, offset, value);
    } else if (offset >= 0x100 && offset < 0x108) {
        b->enabled |= wide << (FIRST_IRQ + 8 * (offset - 0x100)) & EXISTING;
    } else if (offset >= 0x180 && offset < 0x188) {
        b->enabled &= ~(wide << (FIRST_IRQ + 8 * (offset - 0x180)));
    } else if (offset >= 0x200 && offset < 0x208) {
        b->pending |= wide << (FIRST_IRQ + 8 * (offset - 0x200)) & EXISTING;
    } else if (offset >= 0x280 && offset < 0x288) {
        b->pending &= ~(wide << (FIRST_IRQ + 8 * (offset - 0x280)));
        b->pending |= b->lines & ~b->active_mask;
    } else if (offset == 0xF00) {
        uint32_t irq = value & 0x1FF;
        if (FIRST_IRQ + irq < EXCEPTIONS)
            b->pending |= (uint64_t)1 << (FIRST_IRQ + irq);
    } else if (offset == 0xD04) {
        uint64_t set = (uint64_t)(value >> 31 & 1) << NMI | (uint64_t)(value >> 28 & 1) << PENDSV |
                       (uint64_t)(value >> 26 & 1) << SYSTICK;
        uint64_t clear = (uint64_t)(value >> 27 & 1) << PENDSV | (uint64_t)(value >> 25 & 1) << SYSTICK;
        b->pending = (b->pending | set) & ~clear;
    } else if (offset == 0xD08) {
        b->shared.vtor = value & 0x3FFFFF80;
    } else if (offset == 0xD0C) {
        if (value >> 16 == 0x05FA) {
            b->priority_group = value >> 8 & 7;
            b->group_mask = 0xFF & ~((2U << b->priority_group) - 1);
            if (value & 4)
                b->shared.reset_requested = 0;
        }
    } else {
        b->scb_stored[offset >> 2 & 1023] = value;
    }
    b->shared.alarm = -1;
}

static void nvic_reset(struct board *b)
{
    b->enabled = ((uint64_t)1 << FIRST_IRQ) - 1;
    b->pending = b->lines = b->active_mask = 0;
    b->active_count = 0;
    memset(b->priority, 0, sizeof b->priority);
    b->priority[NMI] = -2;
    b->priority[HARD_FAULT] = -1;
    b->group_mask = 0xFF;
    b->priority_group = 0;
    b->shared.vtor = 0;
    memset(b->scb_stored, 0, sizeof b->scb_stored);
    b->scb_stored[0xD14 >> 2] = 0x200;
}

/* ---- systick.py ---- */

static ticks systick_current(struct board *b)
{
    if (b->st_wrap >= NEVER)
        return b->st_stopped_at;
    return (b->st_wrap - b->shared.now) / b->shared.cycle & 0xFFFFFF;
}

static void systick_set_wrap(struct board *b, ticks when)
{
    b->st_wrap = when;
    schedule(b, b->systick_slot, when);
}

static uint32_t systick_read(struct board *b, uint32_t offset)
{
    if (offset == 0x10) {
        uint32_t value = b->st_control | b->st_flag;
        b->st_flag = 0;
        return value;
    }
    if (offset == 0x14)
        return b->st_reload;
    if (offset == 0x18)
        return (uint32_t)systick_current(b);
    return 0x8000000FU + 0x270FF0U;
}

static void systick_write(struct board *b, uint32_t offset, uint32_t value)
{
    struct shared *s = &b->shared;
    if (offset == 0x10) {
        bool was = b->st_control & 1;
        b->st_stopped_at = systick_current(b);
        b->st_control = value & 7;
        if (!(b->st_control & 1)) {
            systick_set_wrap(b, NEVER);
        } else if (!was) {
            ticks remaining = b->st_stopped_at ? b->st_stopped_at : (ticks)b->st_reload + 1;
            systick_set_wrap(b, b->st_reload ? s->now + remaining * s->cycle : NEVER);
        }
    } else if (offset == 0x14) {
        b->st_reload = value & 0xFFFFFF;
    } else if (offset == 0x18) {
        b->st_flag = 0;
        b->st_stopped_at = 0;
        if ((b->st_control & 1) && b->st_reload)
            systick_set_wrap(b, s->now + ((ticks)b->st_reload + 1) * s->cycle);
    }
}

static void systick_event(struct board *b)
{
    b->st_flag = 1U << 16;
    systick_set_wrap(b, b->st_reload ? b->st_wrap + ((ticks)b->st_reload + 1) * b->shared.cycle : NEVER);
    if (b->st_control & 2)
        pend(b, SYSTICK);
}

/* ---- timer.py ---- */

static void timer_set_tick(struct board *b, struct timer *t)
{
    t->tick = b->shared.cycle * t->divider * ((ticks)t->prescale + 1);
}

static uint32_t timer_count(struct board *b, struct timer *t)
{
    if (t->control != 1 || b->shared.now < t->start)
        return t->start_count;
    return (uint32_t)((ticks)t->start_count + (b->shared.now - t->start) / t->tick);
}

static void timer_hold(struct board *b, struct timer *t)
{
    uint32_t count = timer_count(b, t);
    if (t->control == 1 && b->shared.now > t->start)
        t->start += (b->shared.now - t->start) / t->tick * t->tick;
    else if (t->control != 1)
        t->start = b->shared.now;
    t->start_count = count;
}

static void timer_plan(struct board *b, struct timer *t, bool after_match)
{
    t->due = NEVER;
    if (t->control == 1) {
        for (int n = 0; n < 4; n++) {
            if (t->match_control >> 3 * n & 7) {
                ticks ahead = (ticks)(uint32_t)(t->match[n] - t->start_count);
                if (ahead == 0 && after_match)
                    ahead = (ticks)1 << 32;
                ticks when = t->start + ahead * t->tick;
                if (when < t->due) {
                    t->due = when;
                    t->due_match = n;
                }
            }
        }
    }
    schedule(b, t->slot, t->due);
}

static void timer_event(struct board *b, struct timer *t)
{
    uint32_t reached = t->match[t->due_match];
    bool clear = false;
    t->start = t->due;
    t->start_count = reached;
    for (int n = 0; n < 4; n++) {
        uint32_t action = t->match_control >> 3 * n & 7;
        if (action && t->match[n] == reached) {
            if (action & 1)
                t->interrupts |= 1U << n;
            if (action & 2)
                clear = true;
            if (action & 4)
                t->control &= ~1U;
        }
    }
    if (clear) {
        t->start = t->due + t->tick;
        t->start_count = 0;
    }
    timer_plan(b, t, !clear);
    if (t->interrupts)
        set_line(b, t->irq, true);
}

static uint32_t timer_read(struct board *b, int index, uint32_t offset, uint32_t size)
{
    struct timer *t = &b->timers[index];
    (void)size;
    switch (offset) {
    case 0x00: return t->interrupts;
    case 0x04: return t->control;
    case 0x08: return timer_count(b, t);
    case 0x0C: return t->prescale;
    case 0x14: return t->match_control;
    case 0x18: case 0x1C: case 0x20: case 0x24: return t->match[(offset - 0x18) >> 2];
    default: return offset < 0x100 ? t->stored[offset >> 2] : 0;
    }
}

static void timer_write(struct board *b, int index, uint32_t offset, uint32_t value, uint32_t size)
{
    struct timer *t = &b->timers[index];
    (void)size;
    if (offset == 0x00) {
        t->interrupts &= ~value;
        if (!t->interrupts)
            set_line(b, t->irq, false);
        return;
    }
    timer_hold(b, t);
    if (offset == 0x04) {
        t->control = value & 3;
        if (value & 2) {
            t->start = b->shared.now;
            t->start_count = 0;
        }
    } else if (offset == 0x08) {
        t->start = b->shared.now;
        t->start_count = value;
    } else if (offset == 0x0C) {
        t->prescale = value;
        timer_set_tick(b, t);
    } else if (offset == 0x14) {
        t->match_control = value & 0xFFF;
    } else if (offset >= 0x18 && offset < 0x28) {
        t->match[(offset - 0x18) >> 2] = value;
    } else if (offset < 0x100) {
        t->stored[offset >> 2] = value;
    }
    timer_plan(b, t, false);
}

static void timer_reset(struct board *b, struct timer *t)
{
    int slot = t->slot, irq = t->irq;
    ticks divider = t->divider;
    memset(t, 0, sizeof *t);
    t->slot = slot;
    t->irq = irq;
    t->divider = divider;
    t->due = NEVER;
    timer_set_tick(b, t);
}

/* ---- uart.py ---- */

static const int uart_trigger[4] = {1, 4, 8, 14};

static void uart_set_character(struct board *b, struct uart *u)
{
    int64_t multiplier = u->fraction >> 4 & 15 ? u->fraction >> 4 & 15 : 1;
    int64_t add = u->fraction & 15;
    int64_t divisor = u->divisor ? u->divisor : 1;
    double bit = (double)(16 * divisor * b->shared.cycle * u->divider * (multiplier + add)) / (double)multiplier;
    ticks character = (ticks)rint(10 * bit);
    u->character = character > 1 ? character : 1;
    u->lone_byte = u->character * 9 / 10;
}

static void uart_plan(struct board *b, struct uart *u)
{
    ticks next = u->line_count ? u->on_line[u->line_head].when : NEVER;
    u->planned = earlier(next, earlier(u->empty_at, u->timeout_at));
    schedule(b, u->slot, u->planned);
}

static uint32_t uart_cause(struct uart *u)
{
    if ((u->interrupt_enable & 4) && (u->errors & 0x1E))
        return 0x06;
    if ((u->interrupt_enable & 1) && u->received >= uart_trigger[u->fifo_control >> 6])
        return 0x04;
    if ((u->interrupt_enable & 1) && u->timeout && u->received)
        return 0x0C;
    if ((u->interrupt_enable & 2) && u->empty_pending)
        return 0x02;
    return 0x01;
}

static void uart_update_line(struct board *b, struct uart *u)
{
    set_line(b, u->irq, uart_cause(u) != 1);
}

static void uart_event(struct board *b, struct uart *u)
{
    ticks now = b->shared.now;
    while (u->line_count && u->on_line[u->line_head].when <= now) {
        struct line_byte byte = u->on_line[u->line_head];
        u->line_head++;
        u->line_count--;
        if (u->received >= ((u->fifo_control & 1) ? 16 : 1)) {
            u->errors |= 0x02;
        } else {
            u->receiver[u->received++] = byte;
            u->errors |= byte.errors;
        }
        u->timeout_at = byte.when + 4 * u->character;
    }
    if (!u->line_count)
        u->line_head = 0;
    if (u->empty_at <= now) {
        u->empty_at = NEVER;
        u->empty_pending = true;
    }
    if (u->timeout_at <= now) {
        u->timeout_at = NEVER;
        u->timeout = u->received != 0;
    }
    uart_plan(b, u);
    uart_update_line(b, u);
}

static uint32_t uart_line_status(struct board *b, struct uart *u)
{
    ticks now = b->shared.now;
    ticks empty = u->sent_end - u->character;
    if (now < empty && !u->received && spinning(b, u->slot)) {
        wait_until(b, empty);
        now = b->shared.now;
    } else if (empty <= now && now < u->sent_end && !u->received && spinning(b, u->slot)) {
        wait_until(b, u->sent_end);
        now = b->shared.now;
    }
    uint32_t status = u->errors | (u->received ? 1U : 0U);
    if (now >= u->sent_end - u->character)
        status |= 0x20;
    if (now >= u->sent_end)
        status |= 0x40;
    for (int k = 0; k < u->received; k++)
        if (u->receiver[k].errors)
            status |= 0x80;
    if (u->errors) {
        u->errors = 0;
        uart_update_line(b, u);
    }
    return status;
}

static uint32_t uart_read_receiver(struct board *b, struct uart *u)
{
    if (!u->received)
        return 0;
    uint32_t byte = u->receiver[0].byte;
    u->received--;
    memmove(&u->receiver[0], &u->receiver[1], (size_t)u->received * sizeof u->receiver[0]);
    u->timeout = false;
    u->timeout_at = u->received ? b->shared.now + 4 * u->character : NEVER;
    uart_plan(b, u);
    uart_update_line(b, u);
    return byte;
}

static uint32_t uart_read(struct board *b, int index, uint32_t offset, uint32_t size)
{
    struct uart *u = &b->uarts[index];
    (void)size;
    switch (offset) {
    case 0x00: return (u->line_control & 0x80) ? u->divisor & 0xFF : uart_read_receiver(b, u);
    case 0x04: return (u->line_control & 0x80) ? u->divisor >> 8 : u->interrupt_enable;
    case 0x08: {
        uint32_t cause = uart_cause(u);
        if (cause == 0x02) {
            u->empty_pending = false;
            uart_update_line(b, u);
        }
        return cause | ((u->fifo_control & 1) ? 0xC0U : 0U);
    }
    case 0x0C: return u->line_control;
    case 0x14: return uart_line_status(b, u);
    case 0x1C: return u->scratch;
    case 0x28: return u->fraction;
    case 0x30: return 0x80;
    default: return 0;
    }
}

static void uart_send(struct board *b, struct uart *u, uint8_t byte)
{
    ticks now = b->shared.now, end = u->sent_end;
    if (end <= now)
        end = now + u->character;
    else if (end <= now + ((u->fifo_control & 1) ? 16 : 1) * u->character)
        end += u->character;
    else
        return;
    u->sent_end = end;
    if (u->sent_count == u->sent_capacity) {
        u->sent_capacity = u->sent_capacity ? 2 * u->sent_capacity : 4096;
        u->sent = realloc(u->sent, u->sent_capacity);
        u->sent_at = realloc(u->sent_at, u->sent_capacity * sizeof *u->sent_at);
    }
    u->sent[u->sent_count] = byte;
    u->sent_at[u->sent_count++] = end;
    u->empty_at = later(end - u->character, now + u->lone_byte);
    if (u->planned > u->empty_at)
        uart_plan(b, u);
    if (u->empty_pending) {
        u->empty_pending = false;
        uart_update_line(b, u);
    }
}

static void uart_write(struct board *b, int index, uint32_t offset, uint32_t value, uint32_t size)
{
    struct uart *u = &b->uarts[index];
    (void)size;
    switch (offset) {
    case 0x00:
        if (u->line_control & 0x80) {
            u->divisor = (u->divisor & 0xFF00) | (value & 0xFF);
            uart_set_character(b, u);
        } else {
            uart_send(b, u, (uint8_t)value);
        }
        break;
    case 0x04:
        if (u->line_control & 0x80) {
            u->divisor = (u->divisor & 0xFF) | (value & 0xFF) << 8;
            uart_set_character(b, u);
        } else {
            u->interrupt_enable = value & 0x307;
            uart_update_line(b, u);
        }
        break;
    case 0x08:
        u->fifo_control = value & 0xC9;
        if (value & 2) {
            u->received = 0;
            u->timeout = false;
            u->timeout_at = NEVER;
            uart_plan(b, u);
        }
        uart_update_line(b, u);
        break;
    case 0x0C: u->line_control = value; break;
    case 0x1C: u->scratch = value; break;
    case 0x28:
        u->fraction = value & 0xFF;
        uart_set_character(b, u);
        break;
    default: break;
    }
}

static void uart_reset(struct board *b, struct uart *u)
{
    while (u->sent_count && u->sent_at[u->sent_count - 1] > b->shared.now)
        u->sent_count--;
    u->divisor = 1;
    u->fraction = 0x10;
    u->interrupt_enable = u->line_control = u->fifo_control = u->scratch = u->errors = 0;
    u->received = 0;
    u->line_head = u->line_count = 0;
    u->sent_end = 0;
    u->empty_pending = u->timeout = false;
    u->empty_at = u->timeout_at = u->planned = NEVER;
    uart_set_character(b, u);
}

/* ---- adxl345/core.py and device.py ---- */

enum {
    THRESH_TAP = 0x1D, OFSX = 0x1E, DUR = 0x21, LATENT = 0x22, WINDOW = 0x23, THRESH_ACT = 0x24, THRESH_INACT = 0x25,
    TIME_INACT = 0x26, ACT_INACT_CTL = 0x27, THRESH_FF = 0x28, TIME_FF = 0x29, TAP_AXES = 0x2A, ACT_TAP_STATUS = 0x2B,
    BW_RATE = 0x2C, POWER_CTL = 0x2D, INT_ENABLE = 0x2E, INT_MAP = 0x2F, INT_SOURCE = 0x30, DATA_FORMAT = 0x31,
    DATAX0 = 0x32, DATAZ1 = 0x37, FIFO_CTL = 0x38, FIFO_STATUS = 0x39
};
enum { SINGLE_TAP = 0x40, DOUBLE_TAP = 0x20, ACTIVITY = 0x10, INACTIVITY = 0x08, FREE_FALL = 0x04, EVENTS = 0x7C };
enum { LINK = 0x20, AUTO_SLEEP = 0x10, MEASURE = 0x08, SLEEP = 0x04, ASLEEP = 0x08 };
enum { UNDECIMATED = 0x0F };
#define POP_TICKS (5 * TICKS_PER_SECOND / 1000000)
#define TURN_ON_TICKS (11 * TICKS_PER_SECOND / 10000)
#define SLOWEST_PERIOD (1024 * TICKS_PER_SECOND / 100)

static uint32_t format_count(int32_t raw, int data_format, int bw_rate)
{
    int range = data_format & 3, full = data_format & 8;
    int bits = full ? 10 + range : 10, shift = full ? 8 : 8 + range;
    int32_t count = (raw + (1 << (shift - 1))) >> shift, limit = 1 << (bits - 1);
    if (count < -limit)
        count = -limit;
    if (count > limit - 1)
        count = limit - 1;
    if ((bw_rate & 15) >= 14 && (full || range == 0))
        count &= ~1;
    if (data_format & 4)
        count = (int32_t)((uint32_t)count << (16 - bits));
    return (uint32_t)count & 0xFFFF;
}

static ticks adxl_period(struct adxl345 *d)
{
    ticks nominal = (d->asleep || (d->registers[POWER_CTL] & SLEEP)) ? (TICKS_PER_SECOND / 8) << (d->registers[POWER_CTL] & 3)
                                                  : SLOWEST_PERIOD >> (d->registers[BW_RATE] & 15);
    return (ticks)rint((double)nominal / (1.0 + d->clock_error));
}

static void adxl_restart(struct adxl345 *d, ticks start)
{
    d->period = adxl_period(d);
    d->block_count = d->block_place = 0;
    ticks early = (ticks)rint((double)d->period * d->phase);
    d->converting = d->registers[POWER_CTL] & 8;
    d->next_conversion = start + d->period - early;
}

static void adxl_add(struct adxl345 *d, const int32_t *reading, int32_t *out)
{
    for (int axis = 0; axis < 3; axis++) {
        int32_t shift = (d->registers[DATA_FORMAT] & 0x80) ? d->self_test[axis] : 0;
        out[axis] = reading[axis] + (int8_t)d->registers[OFSX + axis] * 1024 + shift;
    }
}

static void adxl_conversion(struct board *b, struct adxl345 *d, ticks skip, int32_t *out)
{
    ticks place = d->block_place + skip;
    if (place >= d->block_count) {
        b->call.conversions((int32_t)(d - b->sensors), d->next_conversion + skip * d->period, d->period, BLOCK,
                            d->registers[BW_RATE], &d->block[0][0]);
        d->block_count = BLOCK;
        place = 0;
    }
    d->block_place = (int)place + 1;
    adxl_add(d, d->block[place], out);
}

static void adxl_fifo_drop(struct adxl345 *d)
{
    d->fifo_count--;
    memmove(d->fifo[0], d->fifo[1], (size_t)d->fifo_count * sizeof d->fifo[0]);
}

static void adxl_store(struct adxl345 *d, const int32_t *sample, int mode)
{
    int holds = 33;
    if (mode == 3 && !d->triggered) {
        int samples = d->registers[FIFO_CTL] & 31;
        holds = samples > 1 ? samples : 1;
    }
    if (d->fifo_count >= holds) {
        if (mode == 1 || (mode == 3 && d->triggered)) {
            d->overrun = true;
            return;
        }
        adxl_fifo_drop(d);
    }
    memcpy(d->fifo[d->fifo_count++], sample, sizeof d->fifo[0]);
    if (d->fifo_count >= 32)
        d->overrun = true;
}

/* ---- adxl345/events.py ---- */

enum { STEP = 16 * 256, PER_DUR = 2, PER_LATENT = 4, PER_TIME_FF = 16 };
enum { TAP_IDLE, TAP_FIRST, TAP_LONG, TAP_WAITING, TAP_OPEN, TAP_SECOND };

static void events_restart(struct adxl345 *d)
{
    d->activity_on = d->inactivity_on = d->tap_on = d->free_fall_on = false;
    d->awaits_inactivity = true;
    d->has_activity_reference = d->has_inactivity_reference = d->quiet = false;
    d->falling = 0;
    d->tap = TAP_IDLE;
    d->tap_count = 0;
    d->tap_axes = 0;
}

static void events_configure(struct adxl345 *d)
{
    const uint8_t *r = d->registers;
    bool linked = r[POWER_CTL] & LINK;
    bool activity = (r[ACT_INACT_CTL] & 0x70) && ((r[INT_ENABLE] & ACTIVITY) || linked);
    bool inactivity = (r[ACT_INACT_CTL] & 0x07) && ((r[INT_ENABLE] & INACTIVITY) || linked);
    if (activity && !d->activity_on)
        d->has_activity_reference = false;
    if (inactivity && !d->inactivity_on)
        d->has_inactivity_reference = d->quiet = false;
    d->activity_on = activity;
    d->inactivity_on = inactivity;
    d->tap_on = (r[INT_ENABLE] & (SINGLE_TAP | DOUBLE_TAP)) && r[DUR] && (r[TAP_AXES] & 7);
    if (!d->tap_on)
        d->tap = TAP_IDLE;
    d->free_fall_on = r[INT_ENABLE] & FREE_FALL;
    if (!d->free_fall_on)
        d->falling = 0;
}

static bool events_linked(struct adxl345 *d)
{
    return (d->registers[POWER_CTL] & LINK) && d->activity_on && d->inactivity_on;
}

static uint32_t axes_beyond(const int32_t *sample, const int32_t *reference, int32_t limit, uint32_t axes)
{
    uint32_t found = 0;
    for (int axis = 0; axis < 3; axis++) {
        uint32_t bit = 4U >> axis;
        if (axes & bit) {
            int32_t distance = sample[axis] - (reference ? reference[axis] : 0);
            if (distance > limit || distance < -limit)
                found |= bit;
        }
    }
    return found;
}

static uint32_t find_activity(struct adxl345 *d, const int32_t *sample)
{
    uint8_t *r = d->registers;
    if (!d->activity_on || (events_linked(d) && d->awaits_inactivity))
        return 0;
    bool coupled = r[ACT_INACT_CTL] & 0x80;
    if (coupled && !d->has_activity_reference) {
        memcpy(d->activity_reference, sample, sizeof d->activity_reference);
        d->has_activity_reference = true;
    }
    uint32_t axes = axes_beyond(sample, coupled ? d->activity_reference : NULL, r[THRESH_ACT] * STEP, r[ACT_INACT_CTL] >> 4);
    if (!axes)
        return 0;
    r[ACT_TAP_STATUS] = (uint8_t)((r[ACT_TAP_STATUS] & (ASLEEP | 7)) | axes << 4);
    memcpy(d->activity_reference, sample, sizeof d->activity_reference);
    d->has_activity_reference = true;
    d->awaits_inactivity = true;
    d->has_inactivity_reference = d->quiet = false;
    return ACTIVITY;
}

static uint32_t find_inactivity(struct adxl345 *d, const int32_t *sample, ticks now)
{
    const uint8_t *r = d->registers;
    if (!d->inactivity_on || (events_linked(d) && !d->awaits_inactivity))
        return 0;
    bool coupled = r[ACT_INACT_CTL] & 0x08;
    if (coupled && !d->has_inactivity_reference) {
        memcpy(d->inactivity_reference, sample, sizeof d->inactivity_reference);
        d->has_inactivity_reference = true;
    }
    if (axes_beyond(sample, coupled ? d->inactivity_reference : NULL, r[THRESH_INACT] * STEP - 1, r[ACT_INACT_CTL] & 7)) {
        memcpy(d->inactivity_reference, sample, sizeof d->inactivity_reference);
        d->has_inactivity_reference = true;
        d->quiet = false;
        return 0;
    }
    if (!d->quiet) {
        d->quiet = true;
        d->quiet_since = now;
    }
    if (now - d->quiet_since < r[TIME_INACT] * d->second)
        return 0;
    d->quiet_since = now;
    d->awaits_inactivity = false;
    d->has_activity_reference = false;
    return INACTIVITY;
}

static uint32_t find_free_fall(struct adxl345 *d, const int32_t *sample)
{
    int32_t limit = d->registers[THRESH_FF] * STEP;
    for (int axis = 0; axis < 3; axis++)
        if (sample[axis] >= limit || sample[axis] <= -limit) {
            d->falling = 0;
            return 0;
        }
    d->falling++;
    int64_t needed = PER_TIME_FF * d->registers[TIME_FF];
    return d->falling == (needed > 1 ? needed : 1) ? FREE_FALL : 0;
}

static void tap_begin(struct adxl345 *d, int state, int count)
{
    d->tap = state;
    d->tap_count = count;
}

static uint32_t tap_end(struct adxl345 *d, uint32_t events, int state)
{
    d->tap = state;
    d->registers[ACT_TAP_STATUS] = (uint8_t)((d->registers[ACT_TAP_STATUS] & ~7U) | d->tap_axes);
    return events;
}

static uint32_t find_taps(struct adxl345 *d, const int32_t *sample)
{
    const uint8_t *r = d->registers;
    uint32_t axes = axes_beyond(sample, NULL, r[THRESH_TAP] * STEP, r[TAP_AXES] & 7);
    int64_t longest = PER_DUR * r[DUR];
    d->tap_count++;
    switch (d->tap) {
    case TAP_IDLE:
        if (axes) {
            tap_begin(d, TAP_FIRST, 1);
            d->tap_axes = axes;
        }
        return 0;
    case TAP_FIRST:
        if (!axes) {
            if (!(r[INT_ENABLE] & DOUBLE_TAP) || !r[LATENT] || !r[WINDOW])
                return tap_end(d, SINGLE_TAP, TAP_IDLE);
            tap_begin(d, TAP_WAITING, 0);
        } else if (d->tap_count > longest) {
            d->tap = TAP_LONG;
        }
        return 0;
    case TAP_LONG:
        if (!axes)
            d->tap = TAP_IDLE;
        return 0;
    case TAP_WAITING:
        if (axes && (r[TAP_AXES] & 8))
            return tap_end(d, SINGLE_TAP, TAP_LONG);
        if (d->tap_count >= PER_LATENT * r[LATENT])
            tap_begin(d, TAP_OPEN, 0);
        return 0;
    case TAP_OPEN:
        if (axes && d->tap_count == 1)
            return tap_end(d, SINGLE_TAP, TAP_LONG);
        if (axes)
            tap_begin(d, TAP_SECOND, 1);
        else if (d->tap_count >= PER_LATENT * r[WINDOW])
            return tap_end(d, SINGLE_TAP, TAP_IDLE);
        return 0;
    default:
        if (!axes)
            return tap_end(d, SINGLE_TAP | DOUBLE_TAP, TAP_IDLE);
        return d->tap_count > longest ? tap_end(d, SINGLE_TAP, TAP_LONG) : 0;
    }
}

static uint32_t find_in_undecimated(struct adxl345 *d, const int32_t *sample)
{
    uint32_t found = 0;
    if (d->tap_on)
        found |= find_taps(d, sample);
    if (d->free_fall_on)
        found |= find_free_fall(d, sample);
    return found | find_activity(d, sample);
}

static void adxl_raise(struct adxl345 *d, uint32_t events)
{
    const uint8_t *r = d->registers;
    events &= r[INT_ENABLE] & EVENTS;
    if (!events)
        return;
    d->events |= (uint8_t)events;
    uint32_t on_pin = events & ((r[FIFO_CTL] & 0x20) ? r[INT_MAP] : ~(uint32_t)r[INT_MAP]);
    if (r[FIFO_CTL] >> 6 == 3 && on_pin && !d->triggered) {
        d->triggered = true;
        while (d->fifo_count > (r[FIFO_CTL] & 31))
            adxl_fifo_drop(d);
    }
}

static void adxl_configure_sensing(struct adxl345 *d, ticks now)
{
    events_configure(d);
    bool sleeps = d->asleep || (d->registers[POWER_CTL] & SLEEP);
    bool undecimated = d->tap_on || d->free_fall_on || d->activity_on;
    if (!d->converting || sleeps || !undecimated) {
        d->next_undecimated = NEVER;
    } else if (d->next_undecimated >= NEVER) {
        d->fine_count = d->fine_place = 0;
        d->next_undecimated = later(now, d->next_conversion - d->period) + d->undecimated_period;
    }
    d->stepwise = undecimated || d->inactivity_on || sleeps;
}

static void adxl_set_asleep(struct adxl345 *d, bool asleep, ticks now)
{
    d->asleep = asleep;
    d->registers[ACT_TAP_STATUS] = (uint8_t)((d->registers[ACT_TAP_STATUS] & ~ASLEEP) | (asleep ? ASLEEP : 0));
    adxl_restart(d, now);
    adxl_configure_sensing(d, now);
}

static void adxl_catch_up_stepwise(struct board *b, struct adxl345 *d, ticks now)
{
    while (d->converting) {
        ticks at = earlier(d->next_conversion, d->next_undecimated);
        int32_t sample[3];
        if (at > now)
            return;
        if (d->next_undecimated == at) {
            d->next_undecimated += d->undecimated_period;
            if (d->fine_place >= d->fine_count) {
                b->call.conversions((int32_t)(d - b->sensors), at, d->undecimated_period, BLOCK,
                                    d->registers[BW_RATE] | UNDECIMATED, &d->fine[0][0]);
                d->fine_count = BLOCK;
                d->fine_place = 0;
            }
            adxl_add(d, d->fine[d->fine_place++], sample);
            adxl_raise(d, find_in_undecimated(d, sample));
            continue;
        }
        adxl_conversion(b, d, 0, sample);
        d->next_conversion += d->period;
        if (d->asleep || (d->registers[POWER_CTL] & SLEEP)) {
            memcpy(d->out, sample, sizeof d->out);
            uint32_t found = find_activity(d, sample);
            adxl_raise(d, found);
            if (found && d->asleep)
                adxl_set_asleep(d, false, at);
        } else {
            int mode = d->registers[FIFO_CTL] >> 6;
            if (mode == 0) {
                d->overrun = d->overrun || d->data_ready;
                memcpy(d->out, sample, sizeof d->out);
                d->data_ready = true;
            } else {
                adxl_store(d, sample, mode);
            }
            uint32_t found = find_inactivity(d, sample, at);
            adxl_raise(d, found);
            if (found && (d->registers[POWER_CTL] & (LINK | AUTO_SLEEP)) == (LINK | AUTO_SLEEP))
                adxl_set_asleep(d, true, at);
        }
    }
}

static void adxl_catch_up(struct board *b, struct adxl345 *d, ticks now)
{
    if (d->stepwise) {
        adxl_catch_up_stepwise(b, d, now);
        return;
    }
    if (!d->converting || now < d->next_conversion)
        return;
    ticks due = (now - d->next_conversion) / d->period + 1;
    int mode = d->registers[FIFO_CTL] >> 6;
    if (mode == 0) {
        d->overrun = d->overrun || d->data_ready || due > 1;
        adxl_conversion(b, d, due - 1, d->out);
        d->data_ready = true;
        d->next_conversion += due * d->period;
        return;
    }
    bool filling = mode == 1 || (mode == 3 && d->triggered);
    ticks stored = due < 33 ? due : 33;
    ticks skip = filling ? 0 : due - stored;
    for (ticks place = 0; place < stored; place++) {
        int32_t sample[3];
        ticks ahead = place == 0 ? skip : 0;
        adxl_conversion(b, d, ahead, sample);
        d->next_conversion += (ahead + 1) * d->period;
        adxl_store(d, sample, mode);
    }
    if (filling && due > stored) {
        d->block_place = (int)earlier(d->block_place + due - stored, d->block_count);
        d->next_conversion += (due - stored) * d->period;
        d->overrun = true;
    }
}

static uint32_t adxl_int_source(struct adxl345 *d)
{
    uint32_t source = d->events;
    if ((d->registers[FIFO_CTL] >> 6) ? d->fifo_count > 0 : d->data_ready)
        source |= 0x80;
    if (d->fifo_count >= (d->registers[FIFO_CTL] & 31))
        source |= 0x02;
    return source | (d->overrun ? 1U : 0U);
}

static void adxl_end_of_read(struct adxl345 *d, ticks now)
{
    d->reading = d->overrun = false;
    if (d->registers[FIFO_CTL] >> 6 == 0) {
        d->data_ready = false;
    } else if (d->fifo_count) {
        d->shown = d->fifo_count < 32 ? d->fifo_count : 32;
        adxl_fifo_drop(d);
        d->pop_done = now + POP_TICKS;
    }
}

static uint32_t adxl_read(struct adxl345 *d, int address, ticks now)
{
    if (address >= DATAX0 && address <= DATAZ1) {
        d->reading = true;
        int data_format = d->stuck_range < 0 ? d->registers[DATA_FORMAT] : d->stuck_range;
        uint32_t word = format_count(d->out[(address - DATAX0) >> 1], data_format, d->registers[BW_RATE]);
        return (address & 1) ? word >> 8 : word & 0xFF;
    }
    if (d->reading && address == DATAZ1 + 1)
        adxl_end_of_read(d, now);
    if (address == INT_SOURCE) {
        uint32_t value = adxl_int_source(d);
        d->events = 0;
        return value;
    }
    if (address == FIFO_STATUS) {
        int entries = now < d->pop_done ? d->shown : d->fifo_count < 32 ? d->fifo_count : 32;
        return (uint32_t)entries | (d->triggered ? 0x80U : 0U);
    }
    return d->registers[address];
}

static void adxl_write_power(struct adxl345 *d, uint8_t old, uint8_t value, ticks now)
{
    bool waking = (value & MEASURE) && !(old & MEASURE), was_asleep = d->asleep;
    uint32_t both = LINK | AUTO_SLEEP | MEASURE;
    if (waking || ((old ^ value) & LINK))
        events_restart(d);
    if (was_asleep && (value & both) != both) {
        d->asleep = false;
        d->registers[ACT_TAP_STATUS] &= (uint8_t)~ASLEEP;
    }
    if (((old ^ value) & (MEASURE | SLEEP | 3)) || was_asleep != d->asleep)
        adxl_restart(d, waking ? now + TURN_ON_TICKS : now);
}

static void adxl_write(struct adxl345 *d, int address, uint8_t value, ticks now)
{
    bool writable = (address >= 0x1D && address <= 0x2A) || (address >= BW_RATE && address <= 0x2F) ||
                    address == DATA_FORMAT || address == FIFO_CTL;
    if (!writable)
        return;
    uint8_t old = d->registers[address];
    d->registers[address] = value;
    if (address == BW_RATE) {
        adxl_restart(d, now);
    } else if (address == POWER_CTL) {
        adxl_write_power(d, old, value, now);
    } else if (address == FIFO_CTL && value >> 6 != old >> 6) {
        if (value >> 6 == 0) {
            d->fifo_count = 0;
            d->data_ready = d->overrun = false;
        }
        d->triggered = false;
    }
    if (value != old) {
        d->signalling = true;
        adxl_configure_sensing(d, now);
    }
}

static bool adxl_pin(struct board *b, struct adxl345 *d, int number)
{
    adxl_catch_up(b, d, b->shared.now);
    uint32_t map = d->registers[INT_MAP], mapped = number == 2 ? map : ~map;
    bool active = adxl_int_source(d) & d->registers[INT_ENABLE] & mapped & 0xFF;
    return active != ((d->registers[DATA_FORMAT] & 0x20) != 0);
}

static uint32_t adxl_exchange(struct board *b, struct adxl345 *d, uint8_t value, ticks now)
{
    if (d->command < 0) {
        d->command = value;
        d->address = value & 0x3F;
        adxl_catch_up(b, d, now);
        if (d->registers[FIFO_CTL] >> 6 && d->fifo_count && now >= d->pop_done)
            memcpy(d->out, d->fifo[0], sizeof d->out);
        return 0;
    }
    int address = d->address;
    if (d->command & 0x40)
        d->address = (address + 1) & 0x3F;
    if (d->command & 0x80)
        return adxl_read(d, address, now);
    adxl_write(d, address, value, now);
    return 0;
}

static uint32_t adxl_transfer(struct board *b, struct adxl345 *d, uint8_t value, ticks now)
{
    if (d->line_fault == 1)
        return 0xFF;
    uint32_t answer = adxl_exchange(b, d, value, now);
    if (d->line_fault)
        return d->line_fault == 2 ? 0 : 0xFF;
    if (((d->registers[DATA_FORMAT] & 0x40) != 0) != (d->wires == 3))
        return 0xFF;
    return answer;
}

static void adxl_select(struct board *b, struct adxl345 *d, ticks now)
{
    adxl_catch_up(b, d, now);
    d->selected = true;
    d->command = -1;
    d->reading = false;
}

static void adxl_deselect(struct adxl345 *d, ticks now)
{
    if (d->selected && d->reading)
        adxl_end_of_read(d, now);
    d->selected = false;
}

static void adxl_power_on(struct adxl345 *d)
{
    memset(d->registers, 0, sizeof d->registers);
    d->registers[0] = 0xE5;
    d->registers[BW_RATE] = 0x0A;
    d->events = 0;
    d->fifo_count = d->shown = d->block_count = d->block_place = 0;
    d->converting = d->triggered = d->data_ready = d->overrun = d->selected = d->reading = false;
    memset(d->out, 0, sizeof d->out);
    d->pop_done = 0;
    d->command = -1;
    d->address = 0;
    d->asleep = d->stepwise = false;
    d->signalling = true;
    d->next_undecimated = NEVER;
    d->fine_count = d->fine_place = 0;
    d->undecimated_period = (ticks)rint((double)(SLOWEST_PERIOD >> UNDECIMATED) / (1.0 + d->clock_error));
    d->second = (ticks)rint((double)TICKS_PER_SECOND / (1.0 + d->clock_error));
    events_restart(d);
    d->period = adxl_period(d);
}

/* ---- ssp.py ---- */

static void ssp_set_word(struct board *b, struct ssp *p)
{
    p->bits = (p->control0 & 15) + 1;
    ticks prescaler = p->prescaler > 2 ? p->prescaler : 2;
    p->bit = prescaler * ((p->control0 >> 8 & 0xFF) + 1) * b->shared.cycle * p->divider;
}

static int ssp_received(struct board *b, struct ssp *p)
{
    int count = 0;
    while (count < p->words && p->through[count] <= b->shared.now)
        count++;
    return count;
}

static int ssp_waiting(struct board *b, struct ssp *p)
{
    int waiting = p->words - ssp_received(b, p) - 1;
    return waiting > 0 ? waiting : 0;
}

static void ssp_update_raw(struct board *b, struct ssp *p)
{
    int received = ssp_received(b, p);
    p->raw &= ~12U;
    p->raw |= received >= 4 ? 4U : 0U;
    p->raw |= ssp_waiting(b, p) <= 4 ? 8U : 0U;
    if (received && b->shared.now >= p->through[received - 1] + 32 * p->bit)
        p->raw |= 2;
}

static void ssp_update_interrupt(struct board *b, struct ssp *p)
{
    ssp_update_raw(b, p);
    set_line(b, p->irq, (p->raw & p->mask) != 0);
    int received = ssp_received(b, p);
    ticks when = received < p->words ? p->through[received] : NEVER;
    if (received == p->words && p->words && !(p->raw & 2))
        when = p->through[p->words - 1] + 32 * p->bit;
    schedule(b, p->slot, p->mask ? when : NEVER);
}

static uint32_t ssp_read(struct board *b, int index, uint32_t offset, uint32_t size)
{
    struct ssp *p = &b->ssps[index];
    (void)size;
    if (offset == 0x08) {
        if (!p->words || p->through[0] > b->shared.now)
            return 0;
        uint32_t value = p->answer[0];
        p->words--;
        memmove(p->through, p->through + 1, (size_t)p->words * sizeof p->through[0]);
        memmove(p->answer, p->answer + 1, (size_t)p->words * sizeof p->answer[0]);
        if (p->mask)
            ssp_update_interrupt(b, p);
        return value;
    }
    if (offset == 0x0C) {
        if (p->done > b->shared.now && spinning(b, p->slot))
            wait_until(b, p->done);
        int received = ssp_received(b, p), waiting = p->words - received - 1;
        if (waiting < 0)
            waiting = 0;
        uint32_t status = p->done > b->shared.now ? 16U : 0U;
        status |= waiting ? 0U : 1U;
        status |= waiting < 8 ? 2U : 0U;
        status |= received ? 4U : 0U;
        return status | (received >= 8 ? 8U : 0U);
    }
    ssp_update_raw(b, p);
    switch (offset) {
    case 0x00: return p->control0;
    case 0x04: return p->control1;
    case 0x10: return p->prescaler;
    case 0x14: return p->mask;
    case 0x18: return p->raw;
    case 0x1C: return p->raw & p->mask;
    default: return 0;
    }
}

static void ssp_exchange(struct board *b, struct ssp *p, uint32_t value)
{
    bool crowded = p->words >= 8;
    if (!(p->control1 & 2) || (crowded && ssp_waiting(b, p) >= 8))
        return;
    ticks start = later(b->shared.now, p->done);
    p->done = start + p->bits * p->bit;
    uint32_t answer = 0xFFFF;
    if (p->control1 & 1) {
        answer = value;
    } else if (p->selected >= 0 && (p->control0 & 0xC0) == 0xC0) {
        struct adxl345 *d = &b->sensors[p->selected];
        if (p->bits == 16) {
            answer = adxl_transfer(b, d, (uint8_t)(value >> 8), start) << 8;
            answer |= adxl_transfer(b, d, (uint8_t)value, start + 8 * p->bit);
        } else if (p->bits == 8) {
            answer = adxl_transfer(b, d, (uint8_t)value, start);
        }
    }
    if (crowded && (p->words >= 16 || ssp_received(b, p) >= 8)) {
        p->raw |= 1;
    } else {
        p->through[p->words] = p->done;
        p->answer[p->words++] = (uint16_t)(answer & ((1U << p->bits) - 1));
    }
}

static void ssp_write(struct board *b, int index, uint32_t offset, uint32_t value, uint32_t size)
{
    struct ssp *p = &b->ssps[index];
    (void)size;
    switch (offset) {
    case 0x00:
        p->control0 = value & 0xFFFF;
        ssp_set_word(b, p);
        break;
    case 0x04: p->control1 = value & 15; break;
    case 0x08: ssp_exchange(b, p, value & 0xFFFF); break;
    case 0x10:
        p->prescaler = value & 0xFE;
        ssp_set_word(b, p);
        break;
    case 0x14: p->mask = value & 15; break;
    case 0x20: p->raw &= ~(value & 3); break;
    default: break;
    }
    if (p->mask || offset == 0x14)
        ssp_update_interrupt(b, p);
}

static void ssp_reset(struct board *b, struct ssp *p)
{
    p->control0 = p->control1 = p->mask = p->raw = 0;
    p->prescaler = 2;
    p->words = 0;
    p->done = 0;
    p->selected = -1;
    ssp_set_word(b, p);
}

/* ---- gpio.py, and the wiring of board.py ---- */

static void chip_pins_update(struct board *b);

static void pins_changed(struct board *b, int port, uint32_t changed, uint32_t levels)
{
    if (port != 2)
        return;
    int selected = -1;
    for (int k = 0; k < b->sensor_count; k++) {
        uint32_t bit = 1U << k;
        if (changed & bit) {
            if (levels & bit) {
                adxl_deselect(&b->sensors[k], b->shared.now);
                if (b->sensors[k].signalling)
                    chip_pins_update(b);
            } else
                adxl_select(b, &b->sensors[k], b->shared.now);
        }
        if (!(levels & bit))
            selected = k;
    }
    b->ssps[1].selected = selected;
}

static void gpio_update(struct board *b, int port)
{
    uint32_t direction = b->direction[port];
    uint32_t levels = (b->latch[port] & direction) | (b->driven[port] & ~direction);
    uint32_t changed = levels ^ b->levels[port];
    if (changed) {
        b->levels[port] = levels;
        pins_changed(b, port, changed, levels);
        if (b->shared.gpio_watching)
            b->call.pins(port, changed, levels);
    }
}

/* chip_pins.py */
static void chip_pins_update(struct board *b)
{
    static const int pins[SENSORS][2] = {{15, 23}, {16, 24}, {17, 25}, {18, 26}};
    ticks following = NEVER;
    for (int k = 0; k < b->sensor_count; k++) {
        struct adxl345 *d = &b->sensors[k];
        if (!d->signalling)
            continue;
        for (int output = 0; output < 2; output++) {
            int level = adxl_pin(b, d, output + 1);
            if (level != b->pin_level[k][output]) {
                b->pin_level[k][output] = level;
                if (level)
                    b->driven[0] |= 1U << pins[k][output];
                else
                    b->driven[0] &= ~(1U << pins[k][output]);
                gpio_update(b, 0);
            }
        }
        d->signalling = d->registers[INT_ENABLE] != 0;
        if (d->signalling)
            following = earlier(following, d->converting ? earlier(d->next_conversion, d->next_undecimated)
                                                         : d->next_undecimated);
    }
    schedule(b, b->chip_pins_slot, following);
}

static uint32_t gpio_read(struct board *b, int index, uint32_t offset, uint32_t size)
{
    uint32_t port = offset >> 5, value = 0;
    (void)index;
    if (port >= PORTS)
        return 0;
    switch (offset & 0x1C) {
    case 0x00: value = b->direction[port]; break;
    case 0x10: value = b->mask[port]; break;
    case 0x14: value = b->levels[port] & ~b->mask[port]; break;
    case 0x18: value = b->latch[port] & ~b->mask[port]; break;
    default: break;
    }
    value >>= 8 * (offset & 3);
    return size == 4 ? value : value & ((1U << 8 * size) - 1);
}

static void gpio_write(struct board *b, int index, uint32_t offset, uint32_t value, uint32_t size)
{
    uint32_t port = offset >> 5;
    (void)index;
    if (port >= PORTS)
        return;
    uint32_t lane = (size == 4 ? 0xFFFFFFFFU : (1U << 8 * size) - 1) << 8 * (offset & 3);
    uint32_t bits = value << 8 * (offset & 3) & lane, open = ~b->mask[port];
    switch (offset & 0x1C) {
    case 0x00: b->direction[port] = (b->direction[port] & ~lane) | bits; break;
    case 0x10: b->mask[port] = (b->mask[port] & ~lane) | bits; return;
    case 0x14: b->latch[port] = (b->latch[port] & ~(lane & open)) | (bits & open); break;
    case 0x18: b->latch[port] |= bits & open; break;
    case 0x1C: b->latch[port] &= ~(bits & open); break;
    default: break;
    }
    gpio_update(b, (int)port);
}

/* ---- peripherals that stay in Python ---- */

static uint32_t python_read(struct board *b, int index, uint32_t offset, uint32_t size)
{
    return b->call.read(index, offset, size);
}

static void python_write(struct board *b, int index, uint32_t offset, uint32_t value, uint32_t size)
{
    b->call.write(index, offset, value, size);
}

static void slot_event(struct board *b, int slot)
{
    if (slot == b->systick_slot) {
        systick_event(b);
        return;
    }
    if (slot == b->chip_pins_slot) {
        chip_pins_update(b);
        return;
    }
    for (int k = 0; k < TIMERS; k++)
        if (slot == b->timers[k].slot) {
            timer_event(b, &b->timers[k]);
            return;
        }
    for (int k = 0; k < UARTS; k++)
        if (slot == b->uarts[k].slot) {
            uart_event(b, &b->uarts[k]);
            return;
        }
    for (int k = 0; k < SSPS; k++)
        if (slot == b->ssps[k].slot) {
            ssp_update_interrupt(b, &b->ssps[k]);
            return;
        }
    b->call.event(slot);
}

/* ---- cpu.py ---- */

static uint8_t *host(struct board *b, uint32_t address)
{
    if (address < b->flash_size)
        return b->flash + address;
    if (address >= b->ram_base && address - b->ram_base < b->ram_size)
        return b->ram + (address - b->ram_base);
    if (address >= b->ahb_base && address - b->ahb_base < b->ahb_size)
        return b->ahb + (address - b->ahb_base);
    return NULL;
}

static uint64_t on_read(void *uc, uint64_t offset, unsigned size, void *user)
{
    struct region *region = user;
    struct board *b = region->board;
    (void)uc;
    b->shared.now += b->shared.access_ticks;
    b->shared.accesses++;
    if (b->shared.now >= b->shared.until)
        service(b);
    return region->read(b, region->index, (uint32_t)offset, size);
}

static void on_write(void *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    struct region *region = user;
    struct board *b = region->board;
    (void)uc;
    b->shared.now += b->shared.access_ticks;
    b->shared.accesses++;
    if (b->shared.now >= b->shared.until)
        service(b);
    region->write(b, region->index, (uint32_t)offset, (uint32_t)value, size);
}

static int deliverable(struct board *b)
{
    int exception = b->pending ? best_exception(b) : 0;
    if (exception > HARD_FAULT && held_back(b, exception)) {
        b->shared.alarm = -1;
        return 0;
    }
    b->shared.alarm = earlier(b->shared.until, b->shared.limit);
    return exception;
}

static bool must_stop(struct board *b)
{
    if (b->shared.now >= b->shared.until)
        service(b);
    if (b->shared.reset_requested >= 0)
        return true;
    b->next_exception = deliverable(b);
    return b->next_exception != 0 || b->shared.now >= b->shared.limit;
}

static void on_block(void *uc, uint64_t address, uint32_t size, void *user)
{
    struct board *b = user;
    (void)uc;
    (void)address;
    if (b->shared.now >= b->shared.alarm && must_stop(b)) {
        b->stopped = true;
        b->api.emu_stop(b->uc);
        return;
    }
    b->shared.now += (ticks)(size >> 1) * b->shared.cycle;
}

static void on_interrupt(void *uc, uint32_t number, void *user)
{
    struct board *b = user;
    (void)uc;
    uint32_t pc = reg_get(b, PC);
    if (number == 8 || (number == 3 && pc >= 0xFFFFFFF0U)) {
        b->exception_return = true;
        b->returned_to = pc;
    } else if (number == 2) {
        b->supervisor_call = true;
    } else {
        b->intr_error = (int)number;
    }
    b->api.emu_stop(b->uc);
}

static void batch(struct board *b, const enum reg *names, uint32_t *values, int count, bool write)
{
    int ids[16];
    void *places[16];
    for (int k = 0; k < count; k++) {
        ids[k] = b->ids[names[k]];
        places[k] = &values[k];
    }
    if (write)
        b->api.reg_write_batch(b->uc, ids, places, count);
    else
        b->api.reg_read_batch(b->uc, ids, places, count);
}

enum { RUN_DONE = 0, RUN_RESET = 1, RUN_UNICORN = 1000, RUN_INTR = 2000, RUN_STACKING = 3000, RUN_RETURN = 3001 };

static int enter(struct board *b, int exception)
{
    static const enum reg names[9] = {R0, R1, R2, R3, R12, LR, XPSR, SP, CONTROL};
    uint32_t v[9];
    batch(b, names, v, 9, false);
    uint32_t padding = v[7] & 4, frame = v[7] - 32 - padding;
    uint8_t *memory = host(b, frame);
    if (!memory || !host(b, frame + 31))
        return RUN_STACKING;
    uint32_t stacked[8] = {v[0], v[1], v[2], v[3], v[4], v[5], b->shared.pc & ~1U,
                           (v[6] & ~0x200U) | (padding ? 0x200U : 0U)};
    memcpy(memory, stacked, 32);
    bool process = !b->active_count && (v[8] & 2);
    static const enum reg entry[3] = {SP, XPSR, LR};
    uint32_t w[3] = {frame, (v[6] & ~0x0600FC00U & ~0x1FFU) | (uint32_t)exception,
                     b->active_count ? 0xFFFFFFF1U : process ? 0xFFFFFFFDU : 0xFFFFFFF9U};
    batch(b, entry, w, 3, true);
    if (process)
        reg_set(b, CONTROL, v[8] & ~2U);
    b->pending &= ~((uint64_t)1 << exception);
    b->active[b->active_count++] = exception;
    b->active_mask |= (uint64_t)1 << exception;
    b->shared.active_exception = exception;
    b->shared.now += 12 * b->shared.cycle;
    b->shared.exceptions++;
    uint8_t *vector = host(b, b->shared.vtor + 4 * (uint32_t)exception);
    if (!vector)
        return RUN_STACKING;
    uint32_t handler;
    memcpy(&handler, vector, 4);
    b->shared.pc = handler | 1;
    return RUN_DONE;
}

static int leave(struct board *b)
{
    if (!b->active_count)
        return RUN_RETURN;
    uint64_t bit = (uint64_t)1 << b->active[--b->active_count];
    b->active_mask &= ~bit;
    if (b->lines & bit)
        b->pending |= bit;
    b->shared.active_exception = b->active_count ? b->active[b->active_count - 1] : 0;
    bool process = (b->returned_to & 0xC) == 0xC;
    uint32_t sp = reg_get(b, process ? PSP : SP);
    uint8_t *memory = host(b, sp);
    if (!memory || !host(b, sp + 31))
        return RUN_STACKING;
    uint32_t f[8];
    memcpy(f, memory, 32);
    uint32_t after = sp + 32 + ((f[7] & 0x200) ? 4 : 0);
    static const enum reg names[8] = {SP, R0, R1, R2, R3, R12, LR, XPSR};
    uint32_t v[8] = {process ? reg_get(b, SP) : after, f[0], f[1], f[2], f[3], f[4], f[5], f[7] & ~0x200U};
    batch(b, names, v, 8, true);
    if (process) {
        reg_set(b, CONTROL, reg_get(b, CONTROL) | 2);
        reg_set(b, SP, after);
    }
    b->shared.pc = f[6] | 1;
    b->shared.now += 12 * b->shared.cycle;
    return RUN_DONE;
}

static bool sleep_until_wake(struct board *b, ticks limit)
{
    struct shared *s = &b->shared;
    while (!(b->pending & b->enabled) && s->reset_requested < 0) {
        if (s->until > limit) {
            s->now = later(s->now, limit);
            s->sleeping = 1;
            return false;
        }
        s->now = later(s->now, s->until);
        service(b);
    }
    return true;
}

PUBLIC int board_run(struct board *b, ticks limit)
{
    struct shared *s = &b->shared;
    s->limit = limit;
    s->alarm = -1;
    if (s->sleeping) {
        s->sleeping = 0;
        if (!sleep_until_wake(b, limit))
            return RUN_DONE;
    }
    while (s->now < limit) {
        if (s->now >= s->until)
            service(b);
        if (s->reset_requested >= 0) {
            b->next_exception = 0;
            return RUN_RESET;
        }
        int exception = b->next_exception ? b->next_exception : deliverable(b);
        if (exception) {
            b->next_exception = 0;
            int error = enter(b, exception);
            if (error)
                return error;
            s->alarm = b->pending ? -1 : earlier(s->until, limit);
        }
        int error = b->api.emu_start(b->uc, s->pc, 0xFFFFFFF0U, 0, 0);
        if (error)
            return RUN_UNICORN + error;
        if (b->exception_return) {
            b->exception_return = false;
            error = leave(b);
            if (error)
                return error;
            continue;
        }
        if (b->intr_error >= 0) {
            int number = b->intr_error;
            b->intr_error = -1;
            return RUN_INTR + number;
        }
        s->pc = reg_get(b, PC) | 1;
        if (b->supervisor_call) {
            b->supervisor_call = false;
            pend(b, SVCALL);
            continue;
        }
        if (b->stopped) {
            b->stopped = false;
            continue;
        }
        if (!sleep_until_wake(b, limit))
            return RUN_DONE;
    }
    return RUN_DONE;
}

/* ---- what Python calls ---- */

PUBLIC struct board *board_new(void *uc, const struct unicorn *api, const struct callbacks *call, const int *ids)
{
    struct board *b = calloc(1, sizeof *b);
    b->uc = uc;
    b->api = *api;
    b->call = *call;
    memcpy(b->ids, ids, sizeof b->ids);
    for (int k = 0; k < SLOTS; k++)
        b->events[k] = NEVER;
    b->shared.until = NEVER;
    b->shared.reset_requested = -1;
    b->intr_error = -1;
    b->polled_slot = -1;
    b->systick_slot = b->chip_pins_slot = -1;
    size_t handle;
    b->api.hook_add(uc, &handle, 1, (void *)on_interrupt, b, 1, 0);
    b->api.hook_add(uc, &handle, 8, (void *)on_block, b, 1, 0);
    return b;
}

PUBLIC void board_free(struct board *b)
{
    for (int k = 0; k < UARTS; k++) {
        free(b->uarts[k].on_line);
        free(b->uarts[k].sent);
        free(b->uarts[k].sent_at);
    }
    free(b);
}

PUBLIC struct shared *board_shared(struct board *b) { return &b->shared; }

PUBLIC void board_memory(struct board *b, uint8_t *flash, uint32_t flash_size, uint8_t *ram, uint32_t ram_base,
                         uint32_t ram_size, uint8_t *ahb, uint32_t ahb_base, uint32_t ahb_size)
{
    b->flash = flash;
    b->flash_size = flash_size;
    b->ram = ram;
    b->ram_base = ram_base;
    b->ram_size = ram_size;
    b->ahb = ahb;
    b->ahb_base = ahb_base;
    b->ahb_size = ahb_size;
}

/* kind: 'n' NVIC, 't' timer, 'u' UART, 's' SSP, 'g' GPIO, 'k' SysTick and 'w' chip pins, '-' Python (no region of their own), 'p' Python */
PUBLIC int board_map(struct board *b, int kind, int index, int slot, int irq, uint32_t base, uint32_t size)
{
    struct region *r = &b->regions[b->region_count];
    if (slot >= b->slots)
        b->slots = slot + 1;
    r->board = b;
    r->slot = slot;
    r->index = index;
    switch (kind) {
    case 'n': r->read = nvic_read; r->write = nvic_write; break;
    case 't': r->read = timer_read; r->write = timer_write; b->timers[index].slot = slot; b->timers[index].irq = irq; break;
    case 'u': r->read = uart_read; r->write = uart_write; b->uarts[index].slot = slot; b->uarts[index].irq = irq; break;
    case 's': r->read = ssp_read; r->write = ssp_write; b->ssps[index].slot = slot; b->ssps[index].irq = irq; break;
    case 'g': r->read = gpio_read; r->write = gpio_write; break;
    case 'k': b->systick_slot = slot; return 0;
    case 'w': b->chip_pins_slot = slot; return 0;
    case '-': return 0;
    default: r->read = python_read; r->write = python_write; break;
    }
    b->region_count++;
    return b->api.mmio_map(b->uc, base, size, (void *)on_read, r, (void *)on_write, r);
}

PUBLIC void board_add_sensor(struct board *b, double clock_error, double phase, const int32_t *self_test, int wires,
                             int stuck_range)
{
    struct adxl345 *d = &b->sensors[b->sensor_count++];
    d->clock_error = clock_error;
    d->phase = phase;
    memcpy(d->self_test, self_test, sizeof d->self_test);
    d->wires = wires;
    d->stuck_range = stuck_range;
    adxl_power_on(d);
}

PUBLIC void board_power_on_sensor(struct board *b, int index) { adxl_power_on(&b->sensors[index]); }
PUBLIC void board_set_line_fault(struct board *b, int index, int fault) { b->sensors[index].line_fault = fault; }

PUBLIC uint32_t board_read_chip(struct board *b, int index, uint32_t address)
{
    return b->sensors[index].registers[address & 63];
}

PUBLIC void board_write_chip(struct board *b, int index, uint32_t address, uint32_t value)
{
    adxl_catch_up(b, &b->sensors[index], b->shared.now);
    adxl_write(&b->sensors[index], (int)(address & 63), (uint8_t)value, b->shared.now);
    chip_pins_update(b);
}

PUBLIC void board_schedule(struct board *b, int slot, ticks when) { schedule(b, slot, when); }
PUBLIC void board_set_line(struct board *b, int irq, int level) { set_line(b, irq, level != 0); }
PUBLIC void board_pend(struct board *b, int exception) { pend(b, exception); }
PUBLIC int board_spinning(struct board *b, int slot) { return spinning(b, slot); }
PUBLIC void board_wait_until(struct board *b, ticks when) { wait_until(b, when); }

PUBLIC uint32_t board_access(struct board *b, uint32_t address, uint32_t value, int write)
{
    static const uint32_t timer_base[TIMERS] = {0x40004000, 0x40008000, 0x40090000, 0x40094000};
    static const uint32_t uart_base[UARTS] = {0x4000C000, 0x40010000, 0x40098000, 0x4009C000};
    static const uint32_t ssp_base[SSPS] = {0x40088000, 0x40030000};
    for (int k = 0; k < TIMERS; k++)
        if (address - timer_base[k] < 0x1000)
            return write ? (timer_write(b, k, address - timer_base[k], value, 4), 0) : timer_read(b, k, address - timer_base[k], 4);
    for (int k = 0; k < UARTS; k++)
        if (address - uart_base[k] < 0x1000)
            return write ? (uart_write(b, k, address - uart_base[k], value, 4), 0) : uart_read(b, k, address - uart_base[k], 4);
    for (int k = 0; k < SSPS; k++)
        if (address - ssp_base[k] < 0x1000)
            return write ? (ssp_write(b, k, address - ssp_base[k], value, 4), 0) : ssp_read(b, k, address - ssp_base[k], 4);
    if (address - 0x2009C000U < 0x4000)
        return write ? (gpio_write(b, 0, address - 0x2009C000U, value, 4), 0) : gpio_read(b, 0, address - 0x2009C000U, 4);
    return 0;
}

PUBLIC void board_drive(struct board *b, int port, int bit, int level)
{
    if (level)
        b->driven[port] |= 1U << bit;
    else
        b->driven[port] &= ~(1U << bit);
    gpio_update(b, port);
}

/* The clock changes in two steps around the Python peripherals: settle, then go on. dividers: timers, UARTs, SSPs. */
PUBLIC void board_clock_will_change(struct board *b)
{
    b->st_stopped_at = systick_current(b);
    for (int k = 0; k < TIMERS; k++)
        timer_hold(b, &b->timers[k]);
}

PUBLIC void board_clock_changed(struct board *b, const int32_t *dividers)
{
    if (b->st_wrap < NEVER)
        systick_set_wrap(b, b->shared.now + b->st_stopped_at * b->shared.cycle);
    for (int k = 0; k < TIMERS; k++) {
        b->timers[k].divider = dividers[k];
        timer_set_tick(b, &b->timers[k]);
        timer_plan(b, &b->timers[k], false);
    }
    for (int k = 0; k < UARTS; k++) {
        b->uarts[k].divider = dividers[TIMERS + k];
        uart_set_character(b, &b->uarts[k]);
    }
    for (int k = 0; k < SSPS; k++) {
        b->ssps[k].divider = dividers[TIMERS + UARTS + k];
        ssp_set_word(b, &b->ssps[k]);
    }
}

PUBLIC void board_reset(struct board *b, const int32_t *dividers)
{
    for (int k = 0; k < b->slots; k++)
        b->events[k] = NEVER;
    b->shared.until = NEVER;
    b->shared.reset_requested = -1;
    b->shared.sleeping = 0;
    b->shared.active_exception = 0;
    b->stopped = b->exception_return = b->supervisor_call = false;
    b->next_exception = 0;
    nvic_reset(b);
    b->st_control = b->st_reload = b->st_flag = 0;
    b->st_wrap = NEVER;
    b->st_stopped_at = 0;
    for (int k = 0; k < TIMERS; k++) {
        b->timers[k].divider = dividers[k];
        timer_reset(b, &b->timers[k]);
    }
    for (int k = 0; k < UARTS; k++) {
        b->uarts[k].divider = dividers[TIMERS + k];
        uart_reset(b, &b->uarts[k]);
    }
    for (int k = 0; k < SSPS; k++) {
        b->ssps[k].divider = dividers[TIMERS + UARTS + k];
        ssp_reset(b, &b->ssps[k]);
    }
    for (int port = 0; port < PORTS; port++) {
        b->direction[port] = b->mask[port] = b->latch[port] = 0;
        b->driven[port] = b->levels[port] = 0xFFFFFFFFU;
    }
    memset(b->pin_level, -1, sizeof b->pin_level);
    for (int k = 0; k < b->sensor_count; k++)
        b->sensors[k].signalling = true;
    chip_pins_update(b);
}

PUBLIC void board_receive(struct board *b, int index, const uint8_t *bytes, size_t count, int errors)
{
    struct uart *u = &b->uarts[index];
    ticks when = b->shared.now;
    if (u->line_count)
        when = later(when, u->on_line[u->line_head + u->line_count - 1].when);
    if (u->line_head + u->line_count + count > u->line_capacity) {
        u->line_capacity = 2 * (u->line_head + u->line_count + count);
        u->on_line = realloc(u->on_line, u->line_capacity * sizeof *u->on_line);
    }
    for (size_t k = 0; k < count; k++) {
        struct line_byte *byte = &u->on_line[u->line_head + u->line_count++];
        when += u->character;
        byte->when = when;
        byte->byte = bytes[k];
        byte->errors = (uint8_t)errors;
    }
    uart_plan(b, u);
}

/* Number of bytes that have left the line; their addresses. */
PUBLIC size_t board_sent(struct board *b, int index, const uint8_t **bytes, const ticks **at)
{
    struct uart *u = &b->uarts[index];
    size_t count = u->sent_count;
    while (count && u->sent_at[count - 1] > b->shared.now)
        count--;
    *bytes = u->sent;
    *at = u->sent_at;
    return count;
}

PUBLIC void board_sent_taken(struct board *b, int index, size_t count)
{
    struct uart *u = &b->uarts[index];
    u->sent_count -= count;
    memmove(u->sent, u->sent + count, u->sent_count);
    memmove(u->sent_at, u->sent_at + count, u->sent_count * sizeof *u->sent_at);
}

PUBLIC ticks board_character(struct board *b, int index) { return b->uarts[index].character; }
