/* ADXL345 over SPI mode 3, 16-bit words: one word is one register access. */
#ifndef ADXL345_H
#define ADXL345_H

#include <stdbool.h>
#include <stdint.h>

#define ADXL345_FULL_RESOLUTION 0x08U
#define ADXL345_SELF_TEST 0x80U
#define ADXL345_RATE_CODE_MAX 0x0FU

/* INT_SOURCE bits */
#define ADXL345_DATA_READY 0x80U
#define ADXL345_OVERRUN 0x01U

struct adxl345_reading {
    uint8_t int_source; /* as it was before the data were read */
    int16_t counts[3];
};

enum adxl345_state {
    ADXL345_ABSENT, /* does not identify itself */
    ADXL345_FAULTY, /* identifies itself, but a register does not read back as written */
    ADXL345_READY
};

/* Set every register that matters for measuring in bypass mode, whatever was in it before, and read each back. */
enum adxl345_state adxl345_configure(uint32_t sensor, uint8_t data_format, uint8_t bw_rate);

/* Read flags and data in one burst; false if DATA_FORMAT or FIFO_CTL do not read back as configured. */
bool adxl345_read(uint32_t sensor, uint8_t data_format, struct adxl345_reading *reading);

/* Smallest BW_RATE code (at least 100 Hz) whose output data rate is not below rate_hz. */
uint8_t adxl345_rate_code(uint32_t rate_hz);

#endif
