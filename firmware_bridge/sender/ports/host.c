/* The sender on this computer, behind a pseudo-terminal, with simulated chips (Linux, macOS). For trying it, and for tests.
 *
 *     cc -O2 -I. -o sender_host ports/host.c sender.c core.c adxl345.c && ./sender_host
 *     gfimu record --port THE_PORT_IT_PRINTS --out run.parquet
 */
#define _XOPEN_SOURCE 700
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "gfimu_port.h"

#define NANOSECONDS 1000000000LL
#define BOOT_BAUD 115200U
#define BOOT_PERIOD_US 10000U /* 100 Hz */
#define PAUSE_NS 20000L
#define COUNTS_PER_G 256
#define SELF_TEST 0x80U
#define FULL_RESOLUTION 0x08U
#define MEASURE 0x08U
#define STREAM 0x80U
#define ODR_HZ 3200U
#define FIFO_DEPTH 33U

enum register_address {
    DEVID = 0x00, BW_RATE = 0x2C, POWER_CTL = 0x2D, INT_SOURCE = 0x30, DATA_FORMAT = 0x31, DATAX0 = 0x32, FIFO_CTL = 0x38
};

/* ---- time: the computer's, or with --measure as fast as samples are taken ---- */

static bool virtual_time;
static uint32_t virtual_us;

uint32_t gfimu_port_time_us(void)
{
    if (virtual_time) {
        return virtual_us;
    }
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((now.tv_sec * NANOSECONDS + now.tv_nsec) / 1000LL);
}

/* ---- chips: registers, FIFO and rate of an ADXL345, at rest, every channel with another bias ---- */

static struct chip {
    uint8_t registers[64];
    uint32_t since_us; /* when its conversions began to be counted */
    uint32_t taken;    /* of them, read or lost */
    uint32_t noise;
} chips[4];

static uint32_t chips_present = GFIMU_CHIPS;

static uint32_t converted(const struct chip *chip)
{
    uint32_t rate_hz = ODR_HZ >> (15U - (chip->registers[BW_RATE] & 0x0FU));
    uint64_t passed_us = gfimu_port_time_us() - chip->since_us;
    return ((chip->registers[POWER_CTL] & MEASURE) != 0U) ? (uint32_t)(passed_us * rate_hz / 1000000U) : 0U;
}

static int16_t reading(struct chip *chip, uint32_t channel)
{
    static const int32_t at_rest[3] = {0, 0, COUNTS_PER_G};
    static const int32_t pushed[3] = {COUNTS_PER_G, -COUNTS_PER_G, 3 * COUNTS_PER_G / 2}; /* by the self-test */
    uint32_t axis = channel % 3U;
    chip->noise = (chip->noise * 1664525U) + 1013904223U; /* Numerical Recipes, 7.1 */
    int32_t counts = at_rest[axis] + (int32_t)(2U * channel) + (int32_t)(chip->noise >> 30);
    counts += ((chip->registers[DATA_FORMAT] & SELF_TEST) != 0U) ? pushed[axis] : 0;
    bool is_full = (chip->registers[DATA_FORMAT] & FULL_RESOLUTION) != 0U;
    return (int16_t)(is_full ? counts : (counts / (1 << (chip->registers[DATA_FORMAT] & 3U))));
}

/* Puts the flags and the oldest conversion, or the newest one, into the registers. */
static void convert(uint32_t number)
{
    struct chip *chip = &chips[number];
    uint32_t ready = converted(chip) - chip->taken;
    bool stream = (chip->registers[FIFO_CTL] & 0xC0U) == STREAM;
    uint32_t watermark = chip->registers[FIFO_CTL] & 0x1FU;
    uint8_t flags = (ready > 0U) ? 0x80U : 0U;
    uint32_t room = stream ? FIFO_DEPTH : 1U;
    if (ready > room) {
        flags |= 0x01U;
        chip->taken += ready - room;
    }
    flags |= (stream && (ready >= watermark)) ? 0x02U : 0U;
    chip->registers[INT_SOURCE] = flags;
    for (uint32_t axis = 0U; (axis < 3U) && (ready > 0U); axis++) {
        uint16_t counts = (uint16_t)reading(chip, (3U * number) + axis);
        chip->registers[DATAX0 + 2U * axis] = (uint8_t)counts;
        chip->registers[DATAX0 + 2U * axis + 1U] = (uint8_t)(counts >> 8);
    }
}

static void write_register(struct chip *chip, uint32_t address, uint8_t value)
{
    chip->registers[address] = value;
    if ((address == BW_RATE) || (address == POWER_CTL) || (address == FIFO_CTL)) { /* conversions are counted anew */
        chip->since_us = gfimu_port_time_us();
        chip->taken = 0U;
    }
}

void gfimu_port_exchange(uint8_t number, uint8_t *bytes, uint8_t count)
{
    struct chip *chip = &chips[number];
    uint32_t address = bytes[0] & 0x3FU;
    bool is_read = (bytes[0] & 0x80U) != 0U;
    uint32_t step = ((bytes[0] & 0x40U) != 0U) ? 1U : 0U;
    bool has_data = false;
    if (number >= chips_present) {
        memset(bytes, 0, count);
        return;
    }
    if (is_read && (address >= INT_SOURCE) && (address < FIFO_CTL)) {
        convert(number);
    }
    for (uint32_t i = 1U; i < count; i++) {
        if (is_read) {
            bytes[i] = chip->registers[address];
            has_data = has_data || (address == DATAX0);
        } else {
            write_register(chip, address, bytes[i]);
        }
        address = (address + step) & 0x3FU;
    }
    if (has_data && ((chip->registers[INT_SOURCE] & 0x80U) != 0U)) {
        chip->taken++;
    }
}

#ifdef GFIMU_TEMPERATURE
/* Warms up from 25 °C by 0.01 °C per 100 ms. */
int16_t gfimu_port_temperature(void)
{
    static uint32_t began_us;
    began_us = (began_us == 0U) ? gfimu_port_time_us() : began_us;
    return (int16_t)(2500U + (((gfimu_port_time_us() - began_us) / 100000U) % 2000U));
}
#endif

uint32_t gfimu_port_spi_khz(void)
{
    return 5000U;
}

/* ---- line ---- */

static int terminal = -1;
static uint32_t sent;

/* A host that has not opened the port, or has left, misses what is sent, as on a wire. */
static bool is_open(void)
{
    struct pollfd line = {.fd = terminal, .events = POLLOUT};
    return (poll(&line, 1U, 0) >= 0) && ((line.revents & POLLHUP) == 0);
}

uint32_t gfimu_port_write(const uint8_t *bytes, uint32_t count)
{
    ssize_t taken = (terminal >= 0) && is_open() ? write(terminal, bytes, count) : (ssize_t)count;
    sent += (taken > 0) ? (uint32_t)taken : 0U;
    return (taken > 0) ? (uint32_t)taken : 0U;
}

bool gfimu_port_write_idle(void)
{
    return true;
}

int16_t gfimu_port_read(void)
{
    uint8_t byte;
    return ((terminal >= 0) && (read(terminal, &byte, 1U) == 1)) ? (int16_t)byte : GFIMU_NOTHING;
}

bool gfimu_port_baud_possible(uint32_t baud)
{
    return baud >= 9600U;
}

void gfimu_port_set_baud(uint32_t baud)
{
    (void)baud; /* a pseudo-terminal has no speed */
}

void gfimu_port_alive(bool light)
{
    (void)light;
}

/* Opens a pseudo-terminal that changes no byte, and prints its name. */
static bool open_terminal(void)
{
    struct termios raw;
    terminal = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if ((terminal < 0) || (grantpt(terminal) != 0) || (unlockpt(terminal) != 0)) {
        return false;
    }
    int host = open(ptsname(terminal), O_RDWR | O_NOCTTY);
    if ((host < 0) || (tcgetattr(host, &raw) != 0)) {
        return false;
    }
    raw.c_iflag = 0U;
    raw.c_oflag = 0U;
    raw.c_lflag = 0U;
    raw.c_cflag = (raw.c_cflag & ~(tcflag_t)(CSIZE | PARENB)) | CS8;
    bool good = tcsetattr(host, TCSANOW, &raw) == 0;
    close(host);
    printf("%s\n", ptsname(terminal));
    fflush(stdout);
    return good;
}

/* ---- program ---- */

/* How fast samples can be taken here: a period of virtual time for each, whatever time it took. */
static void measure(uint32_t samples)
{
    struct timespec begin;
    struct timespec end;
    virtual_time = true;
    gfimu_sender_begin(GFIMU_RESET_POWER_ON, BOOT_BAUD);
    clock_gettime(CLOCK_MONOTONIC, &begin);
    for (uint32_t i = 0U; i < samples; i++) {
        virtual_us += BOOT_PERIOD_US;
        gfimu_sender_step();
    }
    clock_gettime(CLOCK_MONOTONIC, &end);
    double seconds = (double)(end.tv_sec - begin.tv_sec) + (1e-9 * (double)(end.tv_nsec - begin.tv_nsec));
    printf("%u bytes in %.3f s: %.0f samples per second\n", (unsigned)sent, seconds, samples / seconds);
}

/* The value after an option, or what it is without. */
static uint32_t option(int count, char **words, const char *name, uint32_t otherwise)
{
    for (int i = 1; (i + 1) < count; i++) {
        if (strcmp(words[i], name) == 0) {
            return (uint32_t)strtoul(words[i + 1], NULL, 10);
        }
    }
    return otherwise;
}

int main(int count, char **words)
{
    const struct timespec pause = {0, PAUSE_NS};
    uint32_t samples = option(count, words, "--measure", 0U);
    chips_present = option(count, words, "--chips", GFIMU_CHIPS);
    for (uint32_t number = 0U; number < GFIMU_CHIPS; number++) {
        chips[number].registers[DEVID] = 0xE5U;
    }
    if (samples > 0U) {
        measure(samples);
        return 0;
    }
    if (!open_terminal()) {
        perror("no pseudo-terminal");
        return 1;
    }
    gfimu_sender_begin(GFIMU_RESET_POWER_ON, BOOT_BAUD);
    for (;;) {
        gfimu_sender_step();
        nanosleep(&pause, NULL);
    }
}
