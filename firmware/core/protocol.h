/* The numbers of the link protocol, version 1. docs/protocol.md is the table. */
#ifndef POLEPILOT_PROTOCOL_H
#define POLEPILOT_PROTOCOL_H

#define PROTOCOL_MAJOR 1u
#define PROTOCOL_MINOR 0u
#define FIRMWARE_MAJOR 1u
#define FIRMWARE_MINOR 0u

#define MAX_PAYLOAD 40u
#define HEADER_SIZE 3u
#define CRC_SIZE 2u
#define MIN_BODY (HEADER_SIZE + CRC_SIZE)
#define MAX_BODY (HEADER_SIZE + MAX_PAYLOAD + CRC_SIZE)
/* Of a framed body, without the zero at its end. */
#define MAX_ENCODED (MAX_BODY + 1u)

#define MSG_HELLO 0x01u
#define MSG_HEARTBEAT 0x02u
#define MSG_DRIVE 0x03u
#define MSG_PAN 0x04u
#define MSG_ARM 0x05u
#define MSG_ESTOP 0x06u
#define MSG_CLEAR 0x07u
#define MSG_PING 0x08u
#define MSG_HELLO_ACK 0x81u
#define MSG_ACK 0x82u
#define MSG_TELEMETRY 0x83u
#define MSG_PONG 0x84u

#define STATE_IDLE 1u
#define STATE_ARMED 2u
#define STATE_LINK_LOST 3u
#define STATE_ESTOP 4u

#define STATUS_OK 0u
#define STATUS_VERSION 1u
#define STATUS_NOT_READY 2u
#define STATUS_LENGTH 3u
#define STATUS_UNKNOWN_TYPE 4u
#define STATUS_RANGE 5u

#define BOARD_PIC18F4550 1u
#define BOARD_ATMEGA328P 2u
#define BOARD_ATMEGA2560 3u
#define BOARD_HOST 4u

#define FAULT_STOP_BUTTON 0x01u
#define FAULT_PROXIMITY_STOP 0x02u
#define FAULT_LOW_BATTERY 0x04u
#define FAULT_PAN_STUCK 0x08u
#define FAULT_WATCHDOG_RESET 0x10u
#define FAULT_BROWN_OUT_RESET 0x20u
#define FAULT_RECEIVE_OVERFLOW 0x40u

#define FEATURE_ENCODERS 0x01u
#define FEATURE_PROXIMITY 0x02u
#define FEATURE_BATTERY 0x04u
#define FEATURE_PAN 0x08u

#define CLEAR_KEY 0x5AA5u
#define NO_SENSOR 0xFFFFu
#define MAX_DUTY 1000

#define LINK_TIMEOUT_MS 250u
#define DRIVE_TIMEOUT_MS 250u
#define STEERING_TIMEOUT_MS 1000u
#define PAN_TIMEOUT_MS 1000u
#define TELEMETRY_PERIOD_MS 20u
#define DUPLICATE_MS 500u

#endif
