#include "adxl345.h"

#include "hal.h"

#define READ 0x8000U
#define MULTIPLE 0x4000U

#define REGISTER_DEVID 0x00U
#define REGISTER_BW_RATE 0x2CU
#define REGISTER_POWER_CTL 0x2DU
#define REGISTER_INT_SOURCE 0x30U
#define REGISTER_DATA_FORMAT 0x31U
#define REGISTER_FIFO_CTL 0x38U

#define DEVICE_ID 0xE5U
#define MEASURE 0x08U
#define FIFO_BYPASS 0x00U
#define RATE_CODE_100_HZ 0x0AU


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

bool adxl345_configure(uint32_t sensor, uint8_t data_format, uint8_t bw_rate)
{
    if (read_register(sensor, REGISTER_DEVID) != DEVICE_ID) {
        return false;
    }
    write_register(sensor, REGISTER_POWER_CTL, 0U);
    write_register(sensor, REGISTER_DATA_FORMAT, data_format);
    write_register(sensor, REGISTER_BW_RATE, bw_rate);
    write_register(sensor, REGISTER_FIFO_CTL, FIFO_BYPASS);
    write_register(sensor, REGISTER_POWER_CTL, MEASURE);
    return true;
}

bool adxl345_read(uint32_t sensor, uint8_t data_format, struct adxl345_reading *reading)
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
    return ((words[1] >> 8) == data_format) && ((words[4] & 0xFFU) == FIFO_BYPASS);
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
