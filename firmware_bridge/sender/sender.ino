// Arduino: Uno and Nano (ATmega328P), ESP32, Pico (arduino-pico), Teensy, STM32. The sketch's folder has to have its name.
// SCK, MOSI (SDA of the chip), MISO (SDO) are the board's SPI pins; a 5 V board needs level shifters to the chips.
#include <SPI.h>

#include "gfimu_port.h"

static const uint8_t SELECT_PINS[4] = {10, 9, 8, 7};  // of chips 1…4
static const uint32_t BOOT_BAUD = 115200;
static const uint32_t SPI_HZ = 4000000;

uint32_t gfimu_port_time_us(void) { return micros(); }

void gfimu_port_exchange(uint8_t chip, uint8_t *bytes, uint8_t count) {
  SPI.beginTransaction(SPISettings(SPI_HZ, MSBFIRST, SPI_MODE3));
  digitalWrite(SELECT_PINS[chip], LOW);
  SPI.transfer(bytes, count);
  digitalWrite(SELECT_PINS[chip], HIGH);
  SPI.endTransaction();
}

uint32_t gfimu_port_spi_khz(void) { return SPI_HZ / 1000; }

uint32_t gfimu_port_write(const uint8_t *bytes, uint32_t count) {
  const int room = Serial.availableForWrite();
  if (room <= 0) return 0;
  return Serial.write(bytes, count < (uint32_t)room ? count : (uint32_t)room);
}

bool gfimu_port_write_idle(void) { return true; }  // set_baud waits

int16_t gfimu_port_read(void) { return Serial.available() > 0 ? Serial.read() : GFIMU_NOTHING; }

bool gfimu_port_baud_possible(uint32_t baud) {
#ifdef __AVR__
  const uint32_t actual = F_CPU / 8 / ((F_CPU / 4 / baud + 1) / 2);  // as HardwareSerial.cpp chooses it
  // 2.5 %: what the bridges on these boards bear; they have to, for 115200 is 2.1 % off
  return baud >= 9600 && baud <= F_CPU / 8 && (actual > baud ? actual - baud : baud - actual) <= baud / 40;
#else
  return baud >= 9600 && baud <= 2000000;
#endif
}

void gfimu_port_set_baud(uint32_t baud) {
  Serial.flush();
  Serial.begin(baud);
}

void gfimu_port_alive(bool light) {
#ifdef LED_BUILTIN
  static bool shown;
  if (LED_BUILTIN != SCK && light != shown) digitalWrite(LED_BUILTIN, light);  // on an Uno they are one pin
  shown = light;
#else
  (void)light;
#endif
}

void setup() {
  for (uint8_t chip = 0; chip < GFIMU_CHIPS; chip++) {
    digitalWrite(SELECT_PINS[chip], HIGH);
    pinMode(SELECT_PINS[chip], OUTPUT);
  }
#ifdef LED_BUILTIN
  pinMode(LED_BUILTIN, OUTPUT);
#endif
  SPI.begin();
  Serial.begin(BOOT_BAUD);
  gfimu_sender_begin(GFIMU_RESET_POWER_ON, BOOT_BAUD);
}

void loop() { gfimu_sender_step(); }
