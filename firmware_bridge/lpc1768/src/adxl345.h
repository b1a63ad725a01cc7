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
#define ADXL345_WATERMARK 0x02U
#define ADXL345_OVERRUN 0x01U

/* FIFO_CTL: the newest conversion only, or all of them in their order; then the watermark says that the one about to be
 * read is not the last. */
#define ADXL345_NEWEST 0x00U
#define ADXL345_STREAM 0x82U
#define ADXL345_FIFO_DEPTH 33U /* 32 and the one at the output */
#define ADXL345_POP_US 5U      /* from the end of one reading to the next of the same chip (data sheet, FIFO section) */

struct adxl345_setup {
    uint8_t data_format;
    uint8_t bw_rate;
    uint8_t fifo_ctl;
};

struct adxl345_reading {
    uint8_t int_source; /* as it was before the data were read */
    int16_t counts[3];
};

enum adxl345_state {
    ADXL345_ABSENT, /* does not identify itself */
    ADXL345_FAULTY, /* identifies itself, but a register does not read back as written */
    ADXL345_READY
};

/* Set every register that matters for measuring, whatever was in it before, and read each back. */
enum adxl345_state adxl345_configure(uint32_t sensor, const struct adxl345_setup *setup);

/* Forget the conversions in the FIFO. */
void adxl345_clear_fifo(uint32_t sensor, const struct adxl345_setup *setup);

/* Read flags and data in one burst; false if DATA_FORMAT or FIFO_CTL do not read back as configured. */
bool adxl345_read(uint32_t sensor, const struct adxl345_setup *setup, struct adxl345_reading *reading);

/* The same, for where it is done now and then. */
bool adxl345_read_again(uint32_t sensor, const struct adxl345_setup *setup, struct adxl345_reading *reading);

/* INT_SOURCE, for a look whether there is a conversion to read. */
uint8_t adxl345_flags(uint32_t sensor);

/* Smallest BW_RATE code (at least 100 Hz) whose output data rate is not below rate_hz. */
uint8_t adxl345_rate_code(uint32_t rate_hz);

/* Output data rate of a BW_RATE code, Hz, rounded down. */
uint32_t adxl345_output_rate_hz(uint8_t code);

#endif
