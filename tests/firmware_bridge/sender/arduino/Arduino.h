/* What the sketch uses of Arduino, to compile it without. */
#pragma once
#include <stddef.h>
#include <stdint.h>

#define HIGH 1
#define LOW 0
#define OUTPUT 1
#define LED_BUILTIN 13
static const uint8_t SCK = 13;

void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t value);
unsigned long micros();

struct HardwareSerial {
  void begin(unsigned long baud);
  void flush();
  int available();
  int read();
  int availableForWrite();
  size_t write(const uint8_t *bytes, size_t count);
};
extern HardwareSerial Serial;

void setup();
void loop();
