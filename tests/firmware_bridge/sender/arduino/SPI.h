/* What the sketch uses of Arduino's SPI library, to compile it without. */
#pragma once
#include <stddef.h>
#include <stdint.h>

#define MSBFIRST 1
#define SPI_MODE3 0x0C

struct SPISettings {
  SPISettings(uint32_t hz, uint8_t order, uint8_t mode);
};
struct SPIClass {
  void begin();
  void beginTransaction(SPISettings settings);
  void transfer(void *bytes, size_t count);
  void endTransaction();
};
extern SPIClass SPI;
