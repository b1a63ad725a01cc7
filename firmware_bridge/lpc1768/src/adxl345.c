#include "adxl345.h"

#include "hal.h"

#define READ 0x8000U
#define MULTIPLE 0x4000U

#define REGISTER_DEVID 0x00U
#define REGISTER_THRESH_TAP 0x1DU
#define REGISTER_OFSX 0x1EU /* first of 13: offsets, tap, activity, free fall, up to TAP_AXES */
#define REGISTER_BW_RATE 0x2CU
#define REGISTER_POWER_CTL 0x2DU
#define REGISTER_INT_ENABLE 0x2EU
#define REGISTER_INT_MAP 0x2FU
#define REGISTER_INT_SOURCE 0x30U
#define REGISTER_DATA_FORMAT 0x31U
#define REGISTER_FIFO_CTL 0x38U

#define DEVICE_ID 0xE5U
#define MEASURE 0x08U
#define RATE_CODE_100_HZ 0x0AU
#define RATE_CODE_MASK 0x0FU
#define DETECTION_WORDS 7U /* an address and the 13 registers 0x1E…0x2A */

static void write_register(uint32_t sensor, uint32_t address, uint8_t value)
{
    uint16_t word = (uint16_t)((address << 8) | value);
    hal_spi_exchange(sensor, &word, 1U);
}

static uint8_t read_register(uint32_t sensor, uint32_t address)
{
    uint16_t word = (uint16_t)(READ | (address << 8));
    hal_spi_exchange(sensor, &word, 1U);
    return (uint8_t)word;
}

/* No offsets, no tap, activity or free-fall detection: all zero. */
static void clear_detection(uint32_t sensor)
{
    uint16_t words[DETECTION_WORDS] = {(uint16_t)(MULTIPLE | (REGISTER_OFSX << 8)), 0U, 0U, 0U, 0U, 0U, 0U};
    write_register(sensor, REGISTER_THRESH_TAP, 0U);
    hal_spi_exchange(sensor, words, DETECTION_WORDS);
}

static bool detection_is_clear(uint32_t sensor)
{
    uint16_t words[DETECTION_WORDS] = {(uint16_t)(READ | MULTIPLE | (REGISTER_OFSX << 8)), 0U, 0U, 0U, 0U, 0U, 0U};
    uint32_t found = read_register(sensor, REGISTER_THRESH_TAP);
    hal_spi_exchange(sensor, words, DETECTION_WORDS);
    found |= words[0] & 0xFFU; /* the other half came with the address */
    for (uint32_t i = 1U; i < DETECTION_WORDS; i++) {
        found |= words[i];
    }
    return found == 0U;
}

enum adxl345_state adxl345_configure(uint32_t sensor, const struct adxl345_setup *setup)
{
    /* A reset of the processor leaves the chip as it was. The format comes first, unseen: a chip in 3-wire mode hears
     * but its answers go to the wrong pin. */
    write_register(sensor, REGISTER_DATA_FORMAT, setup->data_format);
    if (read_register(sensor, REGISTER_DEVID) != DEVICE_ID) {
        return ADXL345_ABSENT;
    }
    write_register(sensor, REGISTER_POWER_CTL, 0U);
    clear_detection(sensor);
    write_register(sensor, REGISTER_INT_ENABLE, 0U);
    write_register(sensor, REGISTER_INT_MAP, 0U);
    write_register(sensor, REGISTER_BW_RATE, setup->bw_rate);
    adxl345_clear_fifo(sensor, setup);
    write_register(sensor, REGISTER_POWER_CTL, MEASURE);
    bool good = detection_is_clear(sensor);
    good = (read_register(sensor, REGISTER_DATA_FORMAT) == setup->data_format) && good;
    good = (read_register(sensor, REGISTER_BW_RATE) == setup->bw_rate) && good;
    good = (read_register(sensor, REGISTER_POWER_CTL) == MEASURE) && good;
    good = (read_register(sensor, REGISTER_INT_ENABLE) == 0U) && good;
    good = (read_register(sensor, REGISTER_INT_MAP) == 0U) && good;
    good = (read_register(sensor, REGISTER_FIFO_CTL) == setup->fifo_ctl) && good;
    return good ? ADXL345_READY : ADXL345_FAULTY;
}

void adxl345_clear_fifo(uint32_t sensor, const struct adxl345_setup *setup)
{
    write_register(sensor, REGISTER_FIFO_CTL, ADXL345_NEWEST); /* the mode that empties it */
    write_register(sensor, REGISTER_FIFO_CTL, setup->fifo_ctl);
}

static inline __attribute__((always_inline)) bool read_burst(uint32_t sensor, const struct adxl345_setup *setup,
                                                             struct adxl345_reading *reading)
{
    /* Bytes on the wire: command, 0x30 INT_SOURCE, 0x31 DATA_FORMAT, 0x32..0x37 data, 0x38 FIFO_CTL. */
    uint16_t words[HAL_BURST_WORDS];
    words[0] = (uint16_t)(READ | MULTIPLE | (REGISTER_INT_SOURCE << 8));
    words[1] = 0U;
    words[2] = 0U;
    words[3] = 0U;
    words[4] = 0U;
    hal_spi_burst(sensor, words);
    reading->int_source = (uint8_t)words[0];
    /* Data come low byte first, so each value straddles two words. */
    reading->counts[0] = (int16_t)(uint16_t)((words[1] & 0xFFU) | (words[2] & 0xFF00U));
    reading->counts[1] = (int16_t)(uint16_t)((words[2] & 0xFFU) | (words[3] & 0xFF00U));
    reading->counts[2] = (int16_t)(uint16_t)((words[3] & 0xFFU) | (words[4] & 0xFF00U));
    return ((words[1] >> 8) == setup->data_format) && ((words[4] & 0xFFU) == setup->fifo_ctl);
}

bool adxl345_read(uint32_t sensor, const struct adxl345_setup *setup, struct adxl345_reading *reading)
{
    return read_burst(sensor, setup, reading);
}

SELDOM bool adxl345_read_again(uint32_t sensor, const struct adxl345_setup *setup, struct adxl345_reading *reading)
{
    return read_burst(sensor, setup, reading);
}

uint8_t adxl345_flags(uint32_t sensor)
{
    return read_register(sensor, REGISTER_INT_SOURCE);
}

uint32_t adxl345_output_rate_hz(uint8_t code)
{
    uint32_t steps = code & RATE_CODE_MASK;
    return ((uint32_t)3200U << steps) >> ADXL345_RATE_CODE_MAX;
}

uint8_t adxl345_rate_code(uint32_t rate_hz)
{
    uint8_t code = RATE_CODE_100_HZ;
    uint32_t output_rate = 100U;
    while ((output_rate < rate_hz) && (code < ADXL345_RATE_CODE_MAX)) {
        output_rate *= 2U;
        code++;
    }
    return code;
}
