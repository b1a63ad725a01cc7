#include "core.h"

#include <stddef.h>

#include "adxl345.h"
#include "hal.h"

#ifndef GFIMU_BUILD_ID
#define GFIMU_BUILD_ID 0U
#endif
#ifndef GFIMU_CHIP_GAP_US
#define GFIMU_CHIP_GAP_US 0U /* pause between two chips; on purpose wrong, to see what that does to the data */
#endif
#ifndef GFIMU_BOOT_RATE_HZ
#define GFIMU_BOOT_RATE_HZ 100U
#endif

#define SYNC_1 0xA5U
#define SYNC_2 0x5AU
#define FRAME_VERSION 1U
#define HEADER_BYTES 10U
#define PAYLOAD_BYTES 24U
#define CRC_OFFSET (FRAME_BYTES - 2U)
#define NO_READING INT16_MIN

#define COMMAND_SYNC_1 0xC3U
#define COMMAND_SYNC_2 0x3CU
#define COMMAND_HEADER_BYTES 4U
#define COMMAND_PAYLOAD_MAX 8U
#define COMMAND_BYTES_MIN (COMMAND_HEADER_BYTES + 2U)
#define COMMAND_BYTES_MAX (COMMAND_HEADER_BYTES + COMMAND_PAYLOAD_MAX + 2U)

#define RECEIVE_RING 64U /* a power of two */
#define TRANSMIT_RING (FRAME_SLOTS * FRAME_BYTES)
#define BITS_PER_FRAME (FRAME_BYTES * 10U)
#define MICROSECONDS 1000000U
#define SETTLE_SAMPLES 16U /* longest wait for the first conversions after a change of configuration */
#define UNREADABLE_MAX 4U /* the change of rate itself may cost a byte or two */
#define RETRY_US 20000U /* how often one of the missing sensors is looked for */
/* Chips whose output data rate is the sample rate, or up to a tenth above it, are kept pace with: no conversion of theirs
 * is sent twice or left out. A sample waits at most an eighth of its period for them. */
#define PACE_NUMERATOR 11U
#define PACE_DENOMINATOR 10U
#define PACE_SHARE 8U
#define UNHURRIED_MAX 64U
#define MESSAGE_SLOTS 1U /* places in the ring that samples leave to identities and replies */

_Static_assert((RECEIVE_RING & (RECEIVE_RING - 1U)) == 0U, "the receive ring is indexed with a mask");
_Static_assert(HEADER_BYTES + PAYLOAD_BYTES + 6U == FRAME_BYTES, "frame layout");
_Static_assert(SENSOR_COUNT * 6U == PAYLOAD_BYTES, "a sample fills the payload");
_Static_assert(sizeof(GFIMU_ARRAY) <= PAYLOAD_BYTES + 1U, "GFIMU_ARRAY: at most 24 characters");

/* Not static, and read at run time: a finished image can be given another name. */
const volatile char gfimu_array[PAYLOAD_BYTES + 1U] __attribute__((used)) = GFIMU_ARRAY;

static struct {
    /* configuration */
    uint32_t rate_hz;
    uint32_t baud;
    struct adxl345_setup chip;
    uint8_t reset_cause;
    /* sampling */
    bool streaming;
    bool first;
    uint32_t settling; /* samples that may still be waited for */
    uint32_t late_us;  /* time between two samples that is reported: one and a half periods */
    uint32_t pace_us;  /* longest wait for conversions, 0 if the chips are not kept pace with */
    uint32_t patience_us; /* what is left of the time that this sample may wait for conversions */
    uint32_t slow; /* bit mask of sensors that had to be waited for: they are looked at before they are read */
    uint32_t unhurried; /* such looks in a row that found a conversion at once */
    uint16_t sequence;
    uint16_t message_sequence;
    uint32_t last_sample_us;
    uint32_t last_retry_us;
    uint32_t last_retried; /* sensor */
    volatile uint32_t heartbeat;
    uint32_t dropped;
    uint32_t present; /* bit mask of sensors that answer and hold their configuration */
    uint32_t faulty;  /* bit mask of sensors that identify themselves but do not hold it */
    uint16_t sticky;  /* status bits to report in the next frame */
    volatile bool announce;
    bool array_sent; /* of the announcement under way */
    volatile uint32_t new_baud;      /* 0, or the rate to switch to once the reply has left */
    volatile uint32_t fallback_baud; /* 0, or the rate to go back to while no command has come at the new one */
    uint32_t unreadable;             /* pieces of garbage since the last change of rate */
    bool resume;       /* start sampling again at the new rate */
} core;

/* Frames to send. Only whole frames enter and frames never wrap, since the ring is a multiple of their size. */
static uint8_t transmit_ring[TRANSMIT_RING];
static volatile uint32_t transmit_head; /* where the next frame goes */
static volatile uint32_t transmit_tail; /* the next byte to send */

static uint8_t receive_ring[RECEIVE_RING];
static volatile uint32_t receive_head;
static volatile uint32_t receive_tail;

static uint8_t command_bytes[COMMAND_BYTES_MAX];
static uint32_t command_length;

/* CRC-16/CCITT-FALSE, polynomial 0x1021, one nibble at a time. */
static const uint16_t crc_table[16] = {
    0x0000U, 0x1021U, 0x2042U, 0x3063U, 0x4084U, 0x50A5U, 0x60C6U, 0x70E7U,
    0x8108U, 0x9129U, 0xA14AU, 0xB16BU, 0xC18CU, 0xD1ADU, 0xE1CEU, 0xF1EFU,
};

static inline uint32_t crc_step(uint32_t crc, uint32_t byte)
{
    uint32_t half = (crc << 4) ^ crc_table[((crc >> 12) ^ (byte >> 4)) & 0xFU];
    return (half << 4) ^ crc_table[((half >> 12) ^ byte) & 0xFU];
}

uint16_t core_crc16(const uint8_t *bytes, uint32_t count)
{
    uint32_t crc = 0xFFFFU;
    uint32_t i = 0U;
    while ((i + 1U) < count) { /* by twos: this is the longest loop of a sample */
        crc = crc_step(crc_step(crc, bytes[i]), bytes[i + 1U]);
        i += 2U;
    }
    if (i < count) {
        crc = crc_step(crc, bytes[i]);
    }
    return (uint16_t)crc;
}

static void put16(uint8_t *at, uint32_t value)
{
    at[0] = (uint8_t)value;
    at[1] = (uint8_t)(value >> 8);
}

static void put32(uint8_t *at, uint32_t value)
{
    put16(at, value);
    put16(&at[2], value >> 16);
}

static uint32_t get16(const uint8_t *at)
{
    return (uint32_t)at[0] | ((uint32_t)at[1] << 8);
}

static uint32_t get32(const uint8_t *at)
{
    return get16(at) | (get16(&at[2]) << 16);
}

/* ---- frames ---- */

static uint32_t transmit_used(void)
{
    uint32_t head = transmit_head;
    uint32_t tail = transmit_tail;
    return (head >= tail) ? (head - tail) : (head + TRANSMIT_RING - tail);
}

/* Whether a frame finds room and leaves some places free. One frame stays empty to tell full from empty. */
static bool frame_fits(uint32_t places_left)
{
    return (transmit_used() + ((2U + places_left) * FRAME_BYTES)) <= TRANSMIT_RING;
}

/* A free frame in the ring, or NULL when the line can't keep up. */
static uint8_t *frame_open(uint32_t type, uint32_t sequence, uint32_t time_us)
{
    uint8_t *frame = NULL;
    if (frame_fits((type == FRAME_SAMPLE) ? MESSAGE_SLOTS : 0U)) {
        frame = &transmit_ring[transmit_head];
        frame[0] = SYNC_1;
        frame[1] = SYNC_2;
        frame[2] = FRAME_VERSION;
        frame[3] = (uint8_t)type;
        put16(&frame[4], sequence);
        put32(&frame[6], time_us);
    }
    return frame;
}

static void frame_close(uint8_t *frame, uint32_t status, int16_t temperature)
{
    uint32_t next = transmit_head + FRAME_BYTES;
    put16(&frame[34], status);
    put16(&frame[36], (uint16_t)temperature);
    put16(&frame[CRC_OFFSET], core_crc16(frame, CRC_OFFSET));
    transmit_head = (next == TRANSMIT_RING) ? 0U : next;
    hal_transmit_kick();
}

uint32_t core_transmit_peek(const uint8_t **bytes)
{
    uint32_t head = transmit_head;
    uint32_t tail = transmit_tail;
    *bytes = &transmit_ring[tail];
    return (head >= tail) ? (head - tail) : (TRANSMIT_RING - tail);
}

void core_transmit_taken(uint32_t count)
{
    uint32_t next = transmit_tail + count;
    transmit_tail = (next >= TRANSMIT_RING) ? (next - TRANSMIT_RING) : next;
}

static void send_message(uint32_t type, const uint8_t *payload, uint32_t count)
{
    hal_lock();
    uint8_t *frame = frame_open(type, core.message_sequence, hal_time_us());
    if (frame != NULL) {
        for (uint32_t i = 0U; i < PAYLOAD_BYTES; i++) {
            frame[HEADER_BYTES + i] = (i < count) ? payload[i] : 0U;
        }
        frame_close(frame, 0U, HAL_NO_TEMPERATURE);
        core.message_sequence++;
    }
    hal_unlock();
}

static void send_array(void)
{
    uint8_t payload[PAYLOAD_BYTES];
    for (uint32_t i = 0U; i < PAYLOAD_BYTES; i++) {
        payload[i] = (uint8_t)gfimu_array[i];
    }
    send_message(FRAME_ARRAY, payload, PAYLOAD_BYTES);
}

static void send_identity(void)
{
    uint8_t payload[PAYLOAD_BYTES];
    payload[0] = FRAME_VERSION;
    payload[1] = FIRMWARE_MAJOR;
    payload[2] = FIRMWARE_MINOR;
    payload[3] = FIRMWARE_PATCH;
    put16(&payload[4], core.rate_hz);
    payload[6] = core.chip.bw_rate;
    payload[7] = core.chip.data_format;
    put32(&payload[8], core.baud);
    payload[12] = (uint8_t)(core.present | (core.faulty << SENSOR_COUNT));
    payload[13] = core.reset_cause;
    payload[14] = core.streaming ? 1U : 0U;
    payload[15] = SENSOR_COUNT;
    put32(&payload[16], GFIMU_BUILD_ID);
    put16(&payload[20], hal_spi_khz());
    put16(&payload[22], (core.dropped > 0xFFFFU) ? 0xFFFFU : core.dropped);
    send_message(FRAME_IDENTITY, payload, PAYLOAD_BYTES);
}

/* ---- sampling ---- */

SELDOM static void set_state(uint32_t sensor, enum adxl345_state state)
{
    uint32_t bit = 1U << sensor;
    uint32_t present = (state == ADXL345_READY) ? (core.present | bit) : (core.present & ~bit);
    uint32_t faulty = (state == ADXL345_FAULTY) ? (core.faulty | bit) : (core.faulty & ~bit);
    if ((present != core.present) || (faulty != core.faulty)) {
        core.present = present;
        core.faulty = faulty;
        core.announce = true;
    }
}

static void configure_sensors(void)
{
    for (uint32_t sensor = 0U; sensor < SENSOR_COUNT; sensor++) {
        set_state(sensor, adxl345_configure(sensor, &core.chip));
    }
}

static bool keeps_pace(void)
{
    return core.chip.fifo_ctl == ADXL345_STREAM;
}

/* Decide how the chips are read from what they are asked for. */
static void set_pace(void)
{
    uint32_t output_rate_hz = adxl345_output_rate_hz(core.chip.bw_rate);
    bool pace = (output_rate_hz >= core.rate_hz) &&
                ((output_rate_hz * PACE_DENOMINATOR) <= (core.rate_hz * PACE_NUMERATOR));
    core.chip.fifo_ctl = pace ? ADXL345_STREAM : ADXL345_NEWEST;
}

/* The chips and their configuration belong to the sampling while the timer runs. Whatever else uses them stops it first. */
static void stop(void)
{
    hal_timer_stop();
    core.streaming = false;
}

void core_start(void)
{
    stop();
    for (uint32_t sensor = 0U; keeps_pace() && (sensor < SENSOR_COUNT); sensor++) {
        adxl345_clear_fifo(sensor, &core.chip); /* conversions from before belong to no sample */
    }
    core.first = true;
    core.settling = SETTLE_SAMPLES;
    core.slow = 0U;
    core.late_us = (3U * MICROSECONDS) / (2U * core.rate_hz);
    core.pace_us = keeps_pace() ? (MICROSECONDS / (PACE_SHARE * core.rate_hz)) : 0U;
    core.sequence = 0U;
    core.streaming = true;
    core.last_sample_us = hal_time_us();
    hal_timer_start(core.rate_hz);
}

static bool has_converted(uint32_t sensor)
{
    return (adxl345_flags(sensor) & ADXL345_DATA_READY) != 0U;
}

/* A chip that is slower than the sample clock: looks until its conversion is there, or patience ends. One that is there at
 * once time and again is not slow. */
SELDOM static void await_conversion(uint32_t sensor)
{
    bool ready = has_converted(sensor);
    uint32_t since_us = hal_time_us();
    uint32_t waited_us = 0U;
    if (ready) {
        core.unhurried++;
        if (core.unhurried >= UNHURRIED_MAX) {
            core.slow = 0U;
        }
        return;
    }
    core.unhurried = 0U;
    for (uint32_t looks = core.patience_us; !ready && (looks > 0U) && (waited_us < core.patience_us); looks--) {
        ready = has_converted(sensor);
        waited_us = hal_time_us() - since_us;
    }
    core.patience_us -= (waited_us < core.patience_us) ? waited_us : core.patience_us;
}

/* Integer nearest to sum / count; halves go up. */
static int32_t mean(int32_t sum, int32_t count)
{
    int32_t twice = (2 * sum) + count;
    int32_t quotient = twice / (2 * count);
    return ((twice < 0) && ((quotient * 2 * count) != twice)) ? (quotient - 1) : quotient;
}

/* A chip that is faster than the sample clock has converted more than once: reads the rest, so that nothing stays behind,
 * and puts the mean of all in place of the first. */
SELDOM static bool read_rest(uint32_t sensor, struct adxl345_reading *reading)
{
    struct adxl345_reading next = *reading;
    int32_t sums[3] = {reading->counts[0], reading->counts[1], reading->counts[2]};
    int32_t count = 1;
    bool good = true;
    while (good && ((next.int_source & ADXL345_WATERMARK) != 0U) && (count < (int32_t)ADXL345_FIFO_DEPTH)) {
        hal_wait_us(ADXL345_POP_US);
        good = adxl345_read_again(sensor, &core.chip, &next);
        for (uint32_t axis = 0U; axis < 3U; axis++) {
            sums[axis] += next.counts[axis];
        }
        count++;
    }
    for (uint32_t axis = 0U; axis < 3U; axis++) {
        reading->counts[axis] = (int16_t)mean(sums[axis], count);
    }
    reading->int_source |= ADXL345_OVERRUN;
    return good;
}

/* A chip of the same pace that had not just one conversion to read: waits for the one to come, or reads the others. */
SELDOM static bool read_uneven(uint32_t sensor, struct adxl345_reading *reading)
{
    const uint32_t bit = 1U << sensor;
    bool good = true;
    if (((reading->int_source & ADXL345_DATA_READY) == 0U) && ((core.slow & bit) == 0U)) {
        core.slow |= bit;
        await_conversion(sensor);
        good = adxl345_read_again(sensor, &core.chip, reading);
    }
    if (good && ((reading->int_source & ADXL345_WATERMARK) != 0U)) {
        core.slow &= ~bit;
        good = read_rest(sensor, reading);
    }
    return good;
}

/* Reads one sensor into six bytes of the frame; returns its status bits. */
static uint32_t sample_sensor(uint32_t sensor, uint8_t *at)
{
    uint32_t status = 0U;
    struct adxl345_reading reading;
    bool good = ((core.present >> sensor) & 1U) != 0U;
    if (good) {
        if (((core.slow >> sensor) & 1U) != 0U) {
            await_conversion(sensor);
        }
        good = adxl345_read(sensor, &core.chip, &reading);
        uint32_t flags = reading.int_source & (ADXL345_DATA_READY | ADXL345_WATERMARK);
        if ((flags != ADXL345_DATA_READY) && good && keeps_pace()) {
            struct adxl345_reading uneven = reading; /* a copy, so that the other one can stay in registers */
            good = read_uneven(sensor, &uneven);
            reading = uneven;
        }
        if (!good) {
            set_state(sensor, ADXL345_ABSENT); /* until the next try tells more */
        }
    }
    if (!good) {
        reading.int_source = ADXL345_DATA_READY;
        reading.counts[0] = NO_READING;
        reading.counts[1] = NO_READING;
        reading.counts[2] = NO_READING;
        status |= STATUS_MISSING(sensor);
    }
    if ((reading.int_source & ADXL345_OVERRUN) != 0U) {
        status |= STATUS_OVERRUN(sensor);
    }
    if ((reading.int_source & ADXL345_DATA_READY) == 0U) {
        status |= STATUS_STALE;
    }
    for (uint32_t axis = 0U; axis < 3U; axis++) {
        put16(&at[2U * axis], (uint16_t)reading.counts[axis]);
    }
    return status;
}

/* Looks for one missing sensor now and then, so that one that comes back is used again; the next time for the next one,
 * since setting up a sensor takes a third of the shortest sample period. */
static void retry_missing(uint32_t now_us)
{
    const uint32_t all = (1U << SENSOR_COUNT) - 1U;
    if ((core.present != all) && ((now_us - core.last_retry_us) >= RETRY_US)) {
        core.last_retry_us = now_us;
        do {
            core.last_retried = (core.last_retried + 1U) % SENSOR_COUNT;
        } while (((core.present >> core.last_retried) & 1U) != 0U);
        set_state(core.last_retried, adxl345_configure(core.last_retried, &core.chip));
    }
}

void core_sample(void)
{
    uint32_t now_us = hal_time_us();
    uint32_t status = core.sticky;
    if (!core.streaming) {
        return;
    }
    uint8_t *frame = frame_open(FRAME_SAMPLE, core.sequence, now_us);
    if ((now_us - core.last_sample_us) > core.late_us) {
        status |= STATUS_LATE;
    }
    core.last_sample_us = now_us;
    core.heartbeat++;
    uint8_t unsent[PAYLOAD_BYTES]; /* without room for a frame, the chips are read all the same: nothing piles up in them */
    uint8_t *readings = (frame == NULL) ? unsent : &frame[HEADER_BYTES];
    core.patience_us = core.pace_us;
    for (uint32_t sensor = 0U; sensor < SENSOR_COUNT; sensor++) {
        status |= sample_sensor(sensor, &readings[6U * sensor]);
#if GFIMU_CHIP_GAP_US
        uint32_t since_us = hal_time_us();
        while ((hal_time_us() - since_us) < GFIMU_CHIP_GAP_US) {
        }
#endif
    }
    const uint32_t waited_us = core.pace_us - core.patience_us;
    if (waited_us != 0U) {
        hal_timer_delay(waited_us); /* the sample clock goes at the pace of the slowest chip */
    }
    if (frame == NULL) {
        core.sequence++;
        core.dropped++;
        core.sticky |= STATUS_FRAMES_DROPPED;
        return;
    }
    if ((((status & STATUS_STALE) != 0U) || (waited_us != 0U)) && (core.settling > 0U)) {
        core.settling--; /* some sensor has not converted yet, or the clock not found its pace: there is no first sample */
        return;
    }
    core.settling = 0U;
    core.sequence++;
    if (core.first) {
        status &= ~STATUS_ALL_OVERRUNS; /* conversions since the chips were set up are not missed samples */
        core.slow = 0U;                 /* nor is a chip slow that had not begun */
        status |= STATUS_FIRST;
        core.first = false;
    }
    if ((core.chip.data_format & ADXL345_SELF_TEST) != 0U) {
        status |= STATUS_SELF_TEST;
    }
    if (core.faulty != 0U) {
        status |= STATUS_CHIP_FAULT;
    }
    core.sticky = 0U;
    frame_close(frame, status, hal_temperature());
    retry_missing(now_us);
}

uint32_t core_heartbeat(void)
{
    return core.heartbeat;
}

bool core_is_streaming(void)
{
    return core.streaming;
}

/* ---- commands ---- */

void core_receive(uint8_t byte)
{
    uint32_t next = (receive_head + 1U) & (RECEIVE_RING - 1U);
    if (next == receive_tail) {
        core_receive_error();
    } else {
        receive_ring[receive_head] = byte;
        receive_head = next;
    }
}

/* Garbage before the first command at a new rate: the host did not follow, so the board goes back to where it is. */
static void note_unreadable(void)
{
    hal_lock();
    if ((core.fallback_baud != 0U) && (core.new_baud == 0U)) {
        core.unreadable++;
        if (core.unreadable >= UNREADABLE_MAX) {
            core.new_baud = core.fallback_baud;
            core.fallback_baud = 0U;
        }
    }
    hal_unlock();
}

void core_receive_error(void)
{
    hal_lock();
    core.sticky |= STATUS_RECEIVE_ERROR;
    hal_unlock();
    note_unreadable();
}

static bool line_carries(uint32_t baud, uint32_t rate_hz)
{
    return (rate_hz * BITS_PER_FRAME) < baud;
}

/* Changes the sample rate and the sensors' configuration with the sample timer at rest. */
static void reconfigure(uint32_t rate_hz, uint32_t bw_rate, uint32_t data_format)
{
    bool streaming = core.streaming;
    stop();
    core.rate_hz = rate_hz;
    core.chip.bw_rate = (uint8_t)bw_rate;
    core.chip.data_format = (uint8_t)data_format;
    set_pace();
    configure_sensors();
    if (streaming) {
        core_start();
    }
}

static uint32_t set_rate(uint32_t rate_hz, uint32_t code)
{
    uint32_t result = RESULT_DONE;
    if ((rate_hz < RATE_MIN_HZ) || (rate_hz > RATE_MAX_HZ) ||
        ((code != RATE_CODE_AUTO) && (code > ADXL345_RATE_CODE_MAX))) {
        result = RESULT_BAD_VALUE;
    } else if (!line_carries(core.baud, rate_hz)) {
        result = RESULT_LINE_TOO_SLOW;
    } else {
        reconfigure(rate_hz, (code == RATE_CODE_AUTO) ? adxl345_rate_code(rate_hz) : code, core.chip.data_format);
    }
    return result;
}

static uint32_t set_range(uint32_t range, uint32_t full_resolution)
{
    uint32_t result = RESULT_BAD_VALUE;
    if ((range <= 3U) && (full_resolution <= 1U)) {
        reconfigure(core.rate_hz, core.chip.bw_rate, (core.chip.data_format & ADXL345_SELF_TEST) | range |
                    ((full_resolution != 0U) ? ADXL345_FULL_RESOLUTION : 0U));
        result = RESULT_DONE;
    }
    return result;
}

static uint32_t set_self_test(uint32_t on)
{
    uint32_t result = RESULT_BAD_VALUE;
    if (on <= 1U) {
        reconfigure(core.rate_hz, core.chip.bw_rate,
                    (core.chip.data_format & ~ADXL345_SELF_TEST) | ((on != 0U) ? ADXL345_SELF_TEST : 0U));
        result = RESULT_DONE;
    }
    return result;
}

static uint32_t set_baud(uint32_t baud)
{
    uint32_t result = RESULT_DONE;
    if (!hal_baud_possible(baud)) {
        result = RESULT_BAD_VALUE;
    } else if (core.streaming && !line_carries(baud, core.rate_hz)) {
        result = RESULT_LINE_TOO_SLOW;
    } else {
        core.fallback_baud = core.baud;
        core.unreadable = 0U;
        core.new_baud = baud;
    }
    return result;
}

static uint32_t execute(uint32_t command, const uint8_t *payload, uint32_t count)
{
    /* bytes of payload that each command needs, by its number */
    static const uint8_t lengths[] = {0U, 0U, 0U, 3U, 2U, 1U, 0U, 4U};
    uint32_t result = RESULT_DONE;
    if ((command == 0U) || (command >= sizeof(lengths))) {
        return RESULT_UNKNOWN_COMMAND;
    }
    if (count != lengths[command]) {
        return RESULT_BAD_LENGTH;
    }
    switch (command) {
    case COMMAND_START:
        if (line_carries(core.baud, core.rate_hz)) {
            core_start();
        } else {
            result = RESULT_LINE_TOO_SLOW;
        }
        break;
    case COMMAND_STOP:
        stop();
        break;
    case COMMAND_SET_RATE:
        result = set_rate(get16(payload), payload[2]);
        break;
    case COMMAND_SET_RANGE:
        result = set_range(payload[0], payload[1]);
        break;
    case COMMAND_SELF_TEST:
        result = set_self_test(payload[0]);
        break;
    case COMMAND_IDENTIFY:
        core.announce = true;
        break;
    default: /* COMMAND_SET_BAUD: the lengths above admit no other */
        result = set_baud(get32(payload));
        break;
    }
    return result;
}

static void drop_command_bytes(uint32_t count)
{
    command_length -= count;
    for (uint32_t i = 0U; i < command_length; i++) {
        command_bytes[i] = command_bytes[i + count];
    }
}

/* One step of the parser: carries out a whole command, or drops one byte that can't begin one.
 * Returns false when more bytes are needed. */
SELDOM static bool parse_command(void)
{
    if ((command_length >= 1U) && (command_bytes[0] != COMMAND_SYNC_1)) {
        note_unreadable();
        drop_command_bytes(1U);
        return true;
    }
    if ((command_length >= 2U) && (command_bytes[1] != COMMAND_SYNC_2)) {
        drop_command_bytes(1U);
        return true;
    }
    if (command_length < COMMAND_HEADER_BYTES) {
        return false;
    }
    uint32_t count = command_bytes[3];
    uint32_t total = COMMAND_HEADER_BYTES + count + 2U;
    if (count > COMMAND_PAYLOAD_MAX) {
        drop_command_bytes(1U);
        return true;
    }
    if (command_length < total) {
        return false;
    }
    if (core_crc16(command_bytes, total - 2U) != get16(&command_bytes[total - 2U])) {
        core_receive_error();
        drop_command_bytes(1U);
        return true;
    }
    core.fallback_baud = 0U; /* the host is at this rate */
    uint8_t reply[2U + COMMAND_PAYLOAD_MAX];
    reply[0] = command_bytes[2];
    reply[1] = (uint8_t)execute(command_bytes[2], &command_bytes[COMMAND_HEADER_BYTES], count);
    for (uint32_t i = 0U; i < count; i++) {
        reply[2U + i] = command_bytes[COMMAND_HEADER_BYTES + i];
    }
    send_message(FRAME_REPLY, reply, 2U + count);
    drop_command_bytes(total);
    return true;
}

/* Moves a received byte to the parser; false if there is none. */
static bool take_byte(void)
{
    bool received = receive_head != receive_tail;
    if (received) {
        command_bytes[command_length] = receive_ring[receive_tail];
        command_length++;
        receive_tail = (receive_tail + 1U) & (RECEIVE_RING - 1U);
    }
    return received;
}

bool core_has_work(void)
{
    /* one branch: the main loop asks after every interrupt */
    return ((receive_head ^ receive_tail) | (uint32_t)core.announce | core.new_baud) != 0U;
}

/* No frame may be cut by the change of speed: nothing new enters while the queue empties. Returns whether the speed is the
 * one asked for. */
static bool change_baud(void)
{
    if (core.new_baud == 0U) {
        return true;
    }
    if (core.streaming) {
        stop();
        core.resume = true;
    }
    if (!hal_transmit_idle()) {
        return false;
    }
    core.baud = core.new_baud;
    hal_set_baud(core.new_baud);
    core.new_baud = 0U;
    if (core.resume) {
        core.resume = false;
        core_start();
    }
    return true;
}

/* A command is only taken up while its reply finds room, an announcement only sent then: none is lost. Until the line has
 * made room, received bytes wait; those that find no place to wait are reported (core_receive). */
void core_poll(void)
{
    if (!core_has_work() && (command_length < COMMAND_BYTES_MIN)) {
        return;
    }
    while (change_baud() && frame_fits(0U) && (parse_command() || take_byte())) {
    }
    if (core.announce && !core.array_sent && (gfimu_array[0] != '\0') && (core.new_baud == 0U) && frame_fits(0U)) {
        core.array_sent = true;
        send_array();
    }
    if (core.announce && (core.new_baud == 0U) && frame_fits(0U)) {
        core.announce = false;
        core.array_sent = false;
        send_identity();
    }
}

void core_init(uint32_t reset_cause, uint32_t baud)
{
    core.rate_hz = GFIMU_BOOT_RATE_HZ;
    core.baud = baud;
    core.chip.bw_rate = adxl345_rate_code(core.rate_hz);
    core.chip.data_format = ADXL345_FULL_RESOLUTION | 3U; /* ±16 g, 3.9 mg per count */
    set_pace();
    core.reset_cause = (uint8_t)reset_cause;
    core.streaming = false;
    core.sequence = 0U;
    core.message_sequence = 0U;
    core.heartbeat = 0U;
    core.dropped = 0U;
    core.present = 0U;
    core.faulty = 0U;
    core.last_retry_us = hal_time_us();
    core.last_retried = 0U;
    core.sticky = ((reset_cause & RESET_WATCHDOG) != 0U) ? STATUS_WATCHDOG_RESET : 0U;
    core.announce = true;
    core.array_sent = false;
    core.new_baud = 0U;
    core.fallback_baud = 0U;
    core.unreadable = 0U;
    core.resume = false;
    transmit_head = 0U;
    transmit_tail = 0U;
    receive_head = 0U;
    receive_tail = 0U;
    command_length = 0U;
    configure_sensors();
}
