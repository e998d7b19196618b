/* PIC18F4550 machine code as a board: the chip is emulated by gpsim, its serial line is a
 * pseudo-terminal, its pins are those of sim/steps.h. Everything goes over the chip's pins: bits of
 * bytes, voltages, edges. */
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <gpsim_interface.h>
#include <gpsim_time.h>
#include <interface.h>
#include <p18x.h>
#include <sim_context.h>
#include <stimuli.h>

extern "C" {
#include "core/protocol.h"
#include "sim/pty.h"
#include "sim/steps.h"
}
#include "sim/line.h"
#include "sim/ranger.h"

namespace {

constexpr double HZ = 48e6;
constexpr double WATCHDOG_S = 0.004; /* data sheet, parameter 31; gpsim takes 18 ms for all of the family */
constexpr guint64 PER_MS = 12000; /* instruction cycles */
constexpr guint64 PER_US = 12;
constexpr double SUPPLY = 5.0;
constexpr double COUNTS = 1023.0;
constexpr double BATTERY_DIVIDER = 3.0;
constexpr double SERVO_CENTER_US = 1500.0;
constexpr double SERVO_ANGLE_PER_US = 9.0; /* centidegrees */
constexpr guint64 SERVO_SILENCE = 25 * PER_MS;
constexpr guint64 WINDOW = PER_MS; /* three periods of a wheel, one of the pan motor */
constexpr unsigned ENDLESS_LOOP = 0xD7FF; /* bra $ */

/* Pins of the 40-pin package; firmware/README.md, from the other side. */
enum pin {
    RA0 = 2, RA1 = 3, RA2 = 4, RA3 = 5, RA5 = 7,
    RC0 = 15, RC1 = 16, RC2 = 17,
    RD0 = 19, RD1 = 20, RD2 = 21, RD3 = 22, RD4 = 27, RD5 = 28,
    RC6 = 25, RC7 = 26,
    RB0 = 33, RB3 = 36,
};

unsigned starts;

class Chip : public P18F4550 {
public:
    explicit Chip(const char *name) : P18F4550(name, name)
    {
    }
    void reset(RESET_TYPE type) override
    {
        starts++;
        if (hung_) {
            pma->put_opcode(hung_at_, whole_);
            hung_ = false;
        }
        P18F4550::reset(type);
    }
    /* The main loop never comes back from here any more, while interrupts go on. */
    void hang(unsigned address)
    {
        whole_ = pma->get_opcode(address);
        hung_at_ = address;
        hung_ = true;
        pma->put_opcode(address, ENDLESS_LOOP);
    }

private:
    unsigned hung_at_ = 0, whole_ = 0;
    bool hung_ = false;
};

Chip *chip;
double baud;

guint64 now()
{
    return get_cycles().get();
}

/* A wire from a pin to whatever is outside. */
class Wire : public stimulus {
public:
    Wire(const char *name, pin number, double volts, double ohms) : stimulus(name, volts, ohms), node_(name)
    {
        node_.attach_stimulus(chip->get_pin(number));
        node_.attach_stimulus(this);
    }
    void put(double volts)
    {
        if (volts != get_Vth()) {
            set_Vth(volts);
            node_.update();
        }
    }

private:
    Stimulus_Node node_;
};

/* A voltage that comes from outside, with little resistance. */
class Source : public Wire {
public:
    Source(const char *name, pin number, double volts = 0.0) : Wire(name, number, volts, 100.0)
    {
    }
};

/* Watches a pin that the chip drives; a pull-down holds it while the chip does not. */
class Probe : public Wire {
public:
    Probe(const char *name, pin number, double pull = 0.0) : Wire(name, number, pull, 10e3)
    {
    }
    void set_nodeVoltage(double volts) override
    {
        bool level = volts > SUPPLY / 2.0;

        stimulus::set_nodeVoltage(volts);
        if (level == level_) {
            return;
        }
        if (level) {
            rose_ = now();
        } else {
            high_ += now() - rose_;
            width_ = now() - rose_;
            fell_ = now();
        }
        level_ = level;
        changed(level);
    }
    bool level() const
    {
        return level_;
    }
    /* Cycles for which it was high, so far. */
    guint64 high() const
    {
        return high_ + (level_ ? now() - rose_ : 0);
    }
    /* Of the last whole pulse; 0 where there was none lately. */
    guint64 pulse() const
    {
        return width_ > 0 && now() - fell_ < SERVO_SILENCE ? width_ : 0;
    }
    void forget()
    {
        width_ = 0;
    }

protected:
    virtual void changed(bool)
    {
    }

private:
    bool level_ = false;
    guint64 rose_ = 0, fell_ = 0, high_ = 0, width_ = 0;
};

/* The chip's transmitter, bit by bit. */
class Ear : public Probe, public TriggerObject {
public:
    Ear() : Probe("ear", RC6, SUPPLY)
    {
    }
    void callback() override
    {
        if (bit_ < 8) {
            byte_ |= static_cast<unsigned>(level()) << bit_;
            listen(bit_ + 1);
        } else {
            bit_ = -1;
            if (!level()) {
                line_fail("the chip's byte has no stop bit");
            }
            line_put(static_cast<uint8_t>(byte_));
        }
    }
    void hang_up()
    {
        if (bit_ >= 0) {
            get_cycles().clear_break(this);
            bit_ = -1;
        }
    }

protected:
    void changed(bool level) override
    {
        if (!level && bit_ < 0) {
            began_ = now();
            byte_ = 0;
            listen(0);
        }
    }

private:
    void listen(int bit)
    {
        bit_ = bit;
        get_cycles().set_break(began_ + static_cast<guint64>((bit + 1.5) * HZ / 4.0 / baud), this);
    }
    guint64 began_ = 0;
    unsigned byte_ = 0;
    int bit_ = -1;
};

/* The chip's receiver, bit by bit, at the line's full pace. */
class Mouth : public Source, public TriggerObject {
public:
    Mouth() : Source("mouth", RC7, SUPPLY)
    {
    }
    void speak()
    {
        uint8_t byte;

        if (bit_ < 0 && line_next(&byte)) {
            word_ = byte | 0x100u;
            bit_ = 0;
            began_ = now() + 1;
            at(began_);
        }
    }
    void callback() override
    {
        if (bit_ == 10) {
            bit_ = -1;
            speak();
            return;
        }
        put(bit_ == 0 || !(word_ >> (bit_ - 1) & 1u) ? 0.0 : SUPPLY);
        bit_++;
        at(began_ + static_cast<guint64>(bit_ * HZ / 4.0 / baud));
    }

private:
    void at(guint64 cycle)
    {
        get_cycles().set_break(cycle, this);
    }
    guint64 began_ = 0;
    unsigned word_ = 0;
    int bit_ = -1;
};

struct Bridge {
    Probe enable, one_way, other_way;
    guint64 before = 0; /* high time at the window's beginning */

    int16_t duty(guint64 window)
    {
        double share = window > 0 ? static_cast<double>(enable.high() - before) / static_cast<double>(window)
                                  : enable.level();
        return static_cast<int16_t>(lround(1000.0 * share) * (one_way.level() - other_way.level()));
    }
};

/* The world outside, and the steps that standard input asks for. */
class World : public TriggerObject {
public:
    explicit World(unsigned hang_at) : hang_at_(hang_at)
    {
        static const struct inputs AT_REST = {512u, {1500u, 1500u, 1500u}, 12000u, {0, 0}, 0u};

        set_pins(AT_REST);
    }
    void begin()
    {
        next_step();
    }
    void callback() override
    {
        if (!at_end_) {
            open_window();
            at_end_ = true;
            get_cycles().set_break(end_, this);
            return;
        }
        measure();
        steps_answer(line_flush(), &outputs_, starts);
        next_step();
    }

private:
    void open_window()
    {
        window_ = now();
        for (Bridge *bridge : {&left_, &right_, &pan_}) {
            bridge->before = bridge->enable.high();
        }
    }
    void measure()
    {
        guint64 window = now() - window_;

        outputs_.left = left_.duty(window);
        outputs_.right = right_.duty(window);
        outputs_.pan = pan_.duty(window);
        outputs_.steering = 0;
        if (starts_ != starts) {
            starts_ = starts;
            servo_.forget(); /* pulses from before a reset hold nothing any more */
        }
        if (servo_.pulse() > 0) {
            double us = static_cast<double>(servo_.pulse()) / static_cast<double>(PER_US);

            outputs_.steering = static_cast<int16_t>(lround((us - SERVO_CENTER_US) * SERVO_ANGLE_PER_US));
        }
    }
    void set_pins(const struct inputs &in)
    {
        potentiometer_.put((in.pan_adc + 0.5) / (COUNTS + 1.0) * SUPPLY);
        for (int i = 0; i < 3; i++) {
            rangers_[i].put(ranger_mv(in.proximity_mm[i]) / 1000.0);
        }
        battery_.put(in.battery_mv / 1000.0 / BATTERY_DIVIDER);
        /* A closed contact to ground, or an open one: the chip's own pull-up. */
        stop_.set_Zth(in.stop_button ? 1e9 : 10.0);
        stop_.put(in.stop_button ? 1e-6 : 0.0);
    }
    /* The next step, after as many that take no time. Does not return at the end of input. */
    void next_step()
    {
        for (;;) {
            steps_read(&step_);
            if (step_.kind == step::END) {
                exit(0);
            }
            if (step_.kind == step::HANG) {
                chip->hang(hang_at_);
            } else if (step_.kind == step::POWER) {
                line_drop();
                ear_.hang_up();
                chip->reset(POR_RESET);
                window_ = now();
                measure();
            } else {
                line_take(step_.bytes);
                set_pins(step_.inputs);
                end_ = step_.t_us * PER_US;
                if (end_ > now()) {
                    break;
                }
            }
            steps_answer(line_flush(), &outputs_, starts);
        }
        mouth_.speak();
        at_end_ = end_ <= now() + WINDOW;
        if (at_end_) {
            open_window();
        }
        get_cycles().set_break(at_end_ ? end_ : end_ - WINDOW, this);
    }

    Bridge left_{{"left", RC2}, {"left forward", RD0}, {"left backward", RD1}};
    Bridge right_{{"right", RC1}, {"right forward", RD2}, {"right backward", RD3}};
    Bridge pan_{{"pan", RB3}, {"pan left", RD4}, {"pan right", RD5}};
    Probe servo_{"servo", RC0};
    Source potentiometer_{"potentiometer", RA0};
    Source rangers_[3] = {{"ranger left", RA1}, {"ranger centre", RA2}, {"ranger right", RA3}};
    Source battery_{"battery", RA5};
    Source stop_{"stop", RB0};
    Ear ear_;
    Mouth mouth_;

    struct step step_ {};
    struct outputs outputs_ {};
    guint64 end_ = 0, window_ = 0;
    bool at_end_ = false;
    unsigned hang_at_, starts_ = 0;
};

void load(const char *program)
{
    FILE *file = fopen(program, "r");

    initialize_gpsim_core();
    chip = new Chip("chip");
    chip->create();
    chip->create_invalid_registers();
    chip->create_symbols();
    CSimulationContext::GetContext()->add_processor(chip);
    if (file == nullptr || !chip->LoadProgramFile(program, file, "chip")) {
        line_fail("no such program");
    }
    fclose(file);
    chip->set_frequency(HZ);
    chip->wdt.set_timeout(WATCHDOG_S);
    chip->reset(POR_RESET);
    starts = 1;
}

} // namespace

int main(int count, char **words)
{
    if (count != 5) {
        fputs("usage: polepilot-board LINK PROGRAM.hex BOARD_PASS BAUD\n", stderr);
        return 2;
    }
    steps_own_stdout();
    baud = atof(words[4]);
    load(words[2]);
    pty_open(words[1]);
    (void)atexit(pty_close);
    World world(static_cast<unsigned>(strtoul(words[3], nullptr, 0)));
    world.begin();
    for (;;) {
        chip->run(false);
    }
}
