/* A frozen diagram behind the functions of the Functional Mock-up Interface, version 2.0 or 3.0, for co-simulation.

   Declarations are our own, from the standard's text. What is of one diagram is in model.h, which is made with it:
   the kernels, the image of the memory, and where in it the variables are. Each instance has a memory of its own. */

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { OK = 0, WARNING = 1, DISCARD = 2, FAULT = 3, FATAL = 4 };
enum { NEW, STARTING, RUNNING, ENDED, BROKEN };
enum { MAGIC = 0, MODEL = 1, PHASE = 2, BEGAN = 3, SUM = 4, HEAD = 5 }; /* words before the memory of a state */

typedef union { int64_t i; double d; } word;

#if FMI == 2
typedef int boolean;
typedef void logger(void *, const char *, int, const char *, const char *, ...);
struct callbacks { logger *log; void *(*allocate)(size_t, size_t); void (*release)(void *); void *finished, *environment; };
#else
typedef bool boolean;
typedef void logger(void *, int, const char *, const char *);
#endif

struct instance {
  word *memory;  /* in `block`, where a cache line begins */
  void *block;
  kernel *const *code;
  double began;  /* the host's time at the beginning */
  int phase;
  bool stale;    /* outputs are older than what they depend on */
  bool ended;    /* a system has ended the simulation */
  logger *log;
  void *environment;
  char *name;
};

/* A fault, told to the host: what it is about and where. */
static int fault(struct instance *c, const char *format, ...) {
  char text[1024];
  va_list values;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  if (c && c->log) {
#if FMI == 2
    c->log(c->environment, c->name, FAULT, "logStatusError", "%s", text);
#else
    c->log(c->environment, FAULT, "logStatusError", text);
#endif
  }
  return FAULT;
}

/* ---- memory */

static void bind(struct instance *c) {
  word *m = c->memory;
  int64_t base = (int64_t)(intptr_t)m;
  for (int32_t k = 0; k < NUM_FIXUPS; ++k)
    m[fixups[k].at].i = fixups[k].absolute ? base + fixups[k].to : (base + fixups[k].to) / 8;
  for (int32_t r = 0; r < NUM_ROWS; ++r)
    if (rows[r] >= 0) m[TABLE + r].i = (int64_t)(intptr_t)c->code[rows[r]];
}

static void begin_anew(struct instance *c) {
  memset(c->memory, 0, sizeof(word) * NUM_WORDS);
  for (int32_t k = 0; k < NUM_IMAGE;) {
    memcpy(c->memory + image[k], image + k + 2, sizeof(word) * (size_t)image[k + 1]);
    k += 2 + (int32_t)image[k + 1];
  }
  bind(c);
  c->began = BEGIN;
  c->phase = NEW;
  c->stale = true;
  c->ended = false;
}

static struct instance *make(const char *name, const char *token, logger *log, void *environment) {
  struct instance *c = calloc(1, sizeof *c);
  if (!c) return NULL;
  c->log = log;
  c->environment = environment;
  size_t length = name ? strlen(name) : 0;
  c->name = calloc(length + 1, 1);
  c->block = calloc(NUM_WORDS + 8, sizeof(word));
  if (!c->name || !c->block || !token || strcmp(token, TOKEN)) {
    if (c->name && length) memcpy(c->name, name, length);
    fault(c, c->name && c->block ? "the model description is of another FMU: expected " TOKEN : "no memory is left");
    free(c->name);
    free(c->block);
    free(c);
    return NULL;
  }
  if (length) memcpy(c->name, name, length);
  c->memory = (word *)(((uintptr_t)c->block + 63) & ~(uintptr_t)63);
#if LEVELS == 2
  c->code = kernels[sheldrake_cpu_level() >= 3];
#else
  c->code = kernels[0];
#endif
  begin_anew(c);
  return c;
}

static void drop(struct instance *c) {
  if (!c) return;
  free(c->block);
  free(c->name);
  free(c);
}

/* ---- time: the diagram's own goes on from where it was frozen; the host's begins where the host says */

static double host_time(const struct instance *c) {
  double t = c->memory[SLAB].d;
  return c->began == BEGIN ? t : c->began + (t - BEGIN);
}

/* A time at which something happens, if one is within a millionth of a period: hosts add up their steps. */
static double own_time(const struct instance *c, double host) {
  double t = c->began == BEGIN ? host : BEGIN + (host - c->began);
  for (int k = 0; k < NUM_CLOCKS; ++k) {
    double n = rint((t - clocks[k].offset) / clocks[k].period);
    double tick = clocks[k].offset + n * clocks[k].period;
    if (fabs(t - tick) <= 1e-6 * clocks[k].period) return tick;
  }
  return t;
}

/* ---- running */

static int say_failure(struct instance *c) {
  word *m = c->memory;
  int64_t row = m[ROW].i;
  const char *where = row >= 0 && row < NUM_NAMES ? row_names[row] : "the integrator";
  c->phase = BROKEN;
  return fault(c, "%s failed with status %lld at t = %.17g s", where, (long long)m[STATUS].i, host_time(c));
}

static int advance(struct instance *c, double from, double step) {
  word *m = c->memory;
  if (c->phase != RUNNING) return fault(c, "a step is taken after the initialization, before the end, and after no failure");
  if (c->ended) return fault(c, "the simulation has ended at t = %.17g s", host_time(c));
  if (!(step > 0.0) || !isfinite(from + step)) return fault(c, "a step takes %.17g s: expected a positive number", step);
  double now = host_time(c);
  if (fabs(from - now) > 1e-6 * step + 1e-9 * (1.0 + fabs(now)))
    return fault(c, "a step begins at t = %.17g s, but this instance stands at %.17g s", from, now);
  double goal = own_time(c, from + step);
  if (goal < m[SLAB].d) goal = m[SLAB].d;
  m[FRESH].i = 1;
  m[T_BREAK].d = HUGE_VAL;
  c->stale = true;
  for (;;) {
    m[BUDGET].i = 1 << 30;
    m[ADVANCE_T].d = goal;
    int64_t code = c->code[ADVANCE](0.0, NULL, &m[ADVANCE_WORDS].i);
    if (code == 1) return say_failure(c);
    for (int k = 0; k < NUM_LOGS; ++k) m[logs[k] + 2].i = 0; /* nobody asks for what is logged */
    c->ended = code == 4;
    if (code != 2 && code != 3) return OK;
  }
}

/* ---- variables */

static const struct variable *find(struct instance *c, uint32_t reference) {
  if (reference < NUM_VARIABLES) return &variables[reference];
  fault(c, "there is no variable with value reference %lu; they go from 0 to %d", (unsigned long)reference, NUM_VARIABLES - 1);
  return NULL;
}

static int get(struct instance *c, const uint32_t *references, size_t count, double *values) {
  if (c->phase == BROKEN) return fault(c, "a step has failed: only a reset, or an earlier state, helps");
  for (size_t k = 0; k < count; ++k) {
    const struct variable *v = find(c, references[k]);
    if (!v) return FAULT;
    if (v->kind == 'o' && c->stale) {
      if (c->code[OUTPUTS](0.0, NULL, &c->memory[OUTPUTS_WORDS].i)) return say_failure(c);
      c->stale = false;
    }
    values[k] = v->kind == 't' ? host_time(c) : c->memory[SLAB + v->at].d;
  }
  return OK;
}

static int set(struct instance *c, const uint32_t *references, size_t count, const double *values) {
  bool changed = false;
  int status = OK;
  for (size_t k = 0; k < count && !status; ++k) {
    const struct variable *v = find(c, references[k]);
    if (!v) status = FAULT;
    else if (v->kind == 't' || v->kind == 'o') status = fault(c, "%s is computed: it can not be set", v->name);
    else if (v->kind == 's' && c->phase > STARTING) status = fault(c, "%s is a state: it is set before the first step", v->name);
    else if (c->phase > RUNNING) status = fault(c, "%s can not be set after the end", v->name);
    else {
      word new = {.d = values[k]}, *old = &c->memory[SLAB + v->at];
      changed |= new.i != old->i;
      *old = new;
    }
  }
  if (changed) {
    for (int k = 0; k < 3; ++k) c->memory[CONSTANT + k].i += 1;
    c->stale = true;
  }
  return status;
}

/* ---- states: the memory without addresses, so that another process can go on with it */

static int64_t sum(const word *state) {
  uint64_t h = 14695981039346656037u;
  for (size_t k = 0; k < HEAD + (size_t)NUM_WORDS; ++k)
    if (k != SUM) h = (h ^ (uint64_t)state[k].i) * 1099511628211u;
  return (int64_t)h;
}

static int keep(struct instance *c, void **state) {
  word *s = *state ? *state : malloc(sizeof(word) * (HEAD + (size_t)NUM_WORDS));
  if (!s) return fault(c, "no memory is left for a state");
  word *m = s + HEAD;
  memcpy(m, c->memory, sizeof(word) * NUM_WORDS);
  for (int32_t k = 0; k < NUM_FIXUPS; ++k) m[fixups[k].at].i = 0;
  for (int32_t r = 0; r < NUM_ROWS; ++r) m[TABLE + r].i = 0;
  s[MAGIC].i = 0x73686c64726b3031;
  s[MODEL].i = MODEL_HASH;
  s[PHASE].i = c->phase | (c->ended ? 16 : 0);
  s[BEGAN].d = c->began;
  s[SUM].i = sum(s);
  *state = s;
  return OK;
}

static int put(struct instance *c, const word *s) {
  if (!s) return fault(c, "there is no state to go back to");
  memcpy(c->memory, s + HEAD, sizeof(word) * NUM_WORDS);
  bind(c);
  c->phase = (int)(s[PHASE].i & 15);
  c->ended = s[PHASE].i >= 16;
  c->began = s[BEGAN].d;
  c->stale = true;
  return OK;
}

static int to_bytes(struct instance *c, const void *state, uint8_t *bytes, size_t size) {
  if (!state || size < sizeof(word) * (HEAD + (size_t)NUM_WORDS)) return fault(c, "a state needs %lu bytes, not %lu",
    (unsigned long)(sizeof(word) * (HEAD + (size_t)NUM_WORDS)), (unsigned long)size);
  memcpy(bytes, state, sizeof(word) * (HEAD + (size_t)NUM_WORDS));
  return OK;
}

static int from_bytes(struct instance *c, const uint8_t *bytes, size_t size, void **state) {
  size_t needed = sizeof(word) * (HEAD + (size_t)NUM_WORDS);
  if (!bytes || size != needed) return fault(c, "a state has %lu bytes, not %lu", (unsigned long)needed, (unsigned long)size);
  word *s = malloc(needed);
  if (!s) return fault(c, "no memory is left for a state");
  memcpy(s, bytes, needed);
  if (s[MAGIC].i != 0x73686c64726b3031 || s[MODEL].i != MODEL_HASH || s[SUM].i != sum(s)) {
    free(s);
    return fault(c, "these bytes are no state of this FMU, or not as they were written");
  }
  if (*state) {
    memcpy(*state, s, needed);
    free(s);
  } else *state = s;
  return OK;
}

/* ---- phases */

static int start(struct instance *c, double time) {
  if (c->phase != NEW) return fault(c, "the initialization begins after instantiation or a reset");
  if (!isfinite(time)) return fault(c, "the start time is no finite number");
  c->began = time;
  c->phase = STARTING;
  return OK;
}

static int started(struct instance *c) {
  if (c->phase != STARTING) return fault(c, "the initialization can not end, for it has not begun");
  c->phase = RUNNING;
  return OK;
}

static int end(struct instance *c) {
  if (c->phase != RUNNING) return fault(c, "nothing runs that could end");
  c->phase = ENDED;
  return OK;
}

static int no_such(struct instance *c, size_t count) {
  return count ? fault(c, "all variables of this FMU are numbers in double precision") : OK;
}

static int not_offered(struct instance *c, const char *what) { return fault(c, "this FMU offers no %s", what); }

#define C struct instance *c
#define VRS const uint32_t *references, size_t count

#if FMI == 2

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT int fmi2SetDebugLogging(C, int on, size_t count, const char *const *categories) {
  (void)c, (void)on, (void)count, (void)categories;
  return OK;
}
EXPORT struct instance *fmi2Instantiate(const char *name, int type, const char *token, const char *resources,
                                        const struct callbacks *host, int visible, int logging) {
  (void)resources, (void)visible, (void)logging;
  struct instance *c = make(name, token, host ? host->log : NULL, host ? host->environment : NULL);
  if (c && type != 1) {
    fault(c, "this FMU is for co-simulation alone");
    drop(c);
    c = NULL;
  }
  return c;
}
EXPORT void fmi2FreeInstance(C) { drop(c); }
EXPORT int fmi2SetupExperiment(C, int has_tolerance, double tolerance, double time, int has_stop, double stop) {
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
  if (c->phase != NEW || !isfinite(time)) return fault(c, "the experiment is set up before the initialization, at a finite time");
  c->began = time;
  return OK;
}
EXPORT int fmi2EnterInitializationMode(C) { return start(c, c->began); }
EXPORT int fmi2ExitInitializationMode(C) { return started(c); }
EXPORT int fmi2Terminate(C) { return end(c); }
EXPORT int fmi2Reset(C) { return begin_anew(c), OK; }
EXPORT int fmi2GetReal(C, VRS, double *values) { return get(c, references, count, values); }
EXPORT int fmi2SetReal(C, VRS, const double *values) { return set(c, references, count, values); }
#define NONE(NAME, TYPE) \
  EXPORT int fmi2Get##NAME(C, VRS, TYPE *values) { (void)references, (void)values; return no_such(c, count); } \
  EXPORT int fmi2Set##NAME(C, VRS, const TYPE *values) { (void)references, (void)values; return no_such(c, count); }
NONE(Integer, int)
NONE(Boolean, int)
NONE(String, const char *)
EXPORT int fmi2GetFMUstate(C, void **state) { return keep(c, state); }
EXPORT int fmi2SetFMUstate(C, void *state) { return put(c, state); }
EXPORT int fmi2FreeFMUstate(C, void **state) {
  (void)c;
  if (state) free(*state), *state = NULL;
  return OK;
}
EXPORT int fmi2SerializedFMUstateSize(C, void *state, size_t *size) {
  (void)c, (void)state;
  *size = sizeof(word) * (HEAD + (size_t)NUM_WORDS);
  return OK;
}
EXPORT int fmi2SerializeFMUstate(C, void *state, char *bytes, size_t size) { return to_bytes(c, state, (uint8_t *)bytes, size); }
EXPORT int fmi2DeSerializeFMUstate(C, const char *bytes, size_t size, void **state) {
  return from_bytes(c, (const uint8_t *)bytes, size, state);
}
EXPORT int fmi2GetDirectionalDerivative(C, const uint32_t *unknown, size_t num_unknown, const uint32_t *known, size_t num_known,
                                        const double *along, double *result) {
  (void)unknown, (void)num_unknown, (void)known, (void)num_known, (void)along, (void)result;
  return not_offered(c, "derivatives");
}
EXPORT int fmi2SetRealInputDerivatives(C, VRS, const int *orders, const double *values) {
  (void)references, (void)orders, (void)values;
  return count ? not_offered(c, "derivatives of inputs") : OK;
}
EXPORT int fmi2GetRealOutputDerivatives(C, VRS, const int *orders, double *values) {
  (void)references, (void)orders, (void)values;
  return count ? not_offered(c, "derivatives of outputs") : OK;
}
EXPORT int fmi2DoStep(C, double from, double step, int no_way_back) {
  (void)no_way_back;
  int status = advance(c, from, step);
  return !status && c->ended ? DISCARD : status;
}
EXPORT int fmi2CancelStep(C) { return fault(c, "steps do not run on their own: there is none to cancel"); }
EXPORT int fmi2GetStatus(C, int kind, int *value) { (void)kind, (void)value; return c ? DISCARD : FAULT; }
EXPORT int fmi2GetRealStatus(C, int kind, double *value) {
  if (kind != 2) return DISCARD;
  *value = host_time(c);
  return OK;
}
EXPORT int fmi2GetIntegerStatus(C, int kind, int *value) { (void)kind, (void)value; return c ? DISCARD : FAULT; }
EXPORT int fmi2GetBooleanStatus(C, int kind, int *value) {
  if (kind != 3) return DISCARD;
  *value = c->ended;
  return OK;
}
EXPORT int fmi2GetStringStatus(C, int kind, const char **value) { (void)kind, (void)value; return c ? DISCARD : FAULT; }

#else

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT int fmi3SetDebugLogging(C, bool on, size_t count, const char *const *categories) {
  (void)c, (void)on, (void)count, (void)categories;
  return OK;
}
EXPORT struct instance *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
    bool logging, bool event_mode, bool early_return, const uint32_t *wanted, size_t num_wanted, void *environment,
    logger *log, void *intermediate) {
  (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
  (void)wanted, (void)num_wanted, (void)intermediate;
  return make(name, token, log, environment);
}
EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, logger *log) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
  return NULL;
}
EXPORT void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
    bool logging, void *environment, logger *log, void *update, void *lock, void *unlock) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
  (void)update, (void)lock, (void)unlock;
  return NULL;
}
EXPORT void fmi3FreeInstance(C) { drop(c); }
EXPORT int fmi3EnterInitializationMode(C, bool has_tolerance, double tolerance, double time, bool has_stop, double stop) {
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
  return start(c, time);
}
EXPORT int fmi3ExitInitializationMode(C) { return started(c); }
EXPORT int fmi3EnterEventMode(C) { return not_offered(c, "event mode"); }
EXPORT int fmi3EnterStepMode(C) { return not_offered(c, "event mode"); }
EXPORT int fmi3EnterConfigurationMode(C) { return not_offered(c, "structural parameters"); }
EXPORT int fmi3ExitConfigurationMode(C) { return not_offered(c, "structural parameters"); }
EXPORT int fmi3Terminate(C) { return end(c); }
EXPORT int fmi3Reset(C) { return begin_anew(c), OK; }
EXPORT int fmi3GetFloat64(C, VRS, double *values, size_t num_values) {
  if (count != num_values) return fault(c, "%lu variables have %lu values", (unsigned long)count, (unsigned long)num_values);
  return get(c, references, count, values);
}
EXPORT int fmi3SetFloat64(C, VRS, const double *values, size_t num_values) {
  if (count != num_values) return fault(c, "%lu variables have %lu values", (unsigned long)count, (unsigned long)num_values);
  return set(c, references, count, values);
}
#define NONE(NAME, TYPE) \
  EXPORT int fmi3Get##NAME(C, VRS, TYPE *values, size_t n) { (void)references, (void)values, (void)n; return no_such(c, count); } \
  EXPORT int fmi3Set##NAME(C, VRS, const TYPE *values, size_t n) { (void)references, (void)values, (void)n; return no_such(c, count); }
NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(Boolean, bool)
NONE(String, const char *)
EXPORT int fmi3GetBinary(C, VRS, size_t *sizes, const uint8_t **values, size_t n) {
  (void)references, (void)sizes, (void)values, (void)n;
  return no_such(c, count);
}
EXPORT int fmi3SetBinary(C, VRS, const size_t *sizes, const uint8_t *const *values, size_t n) {
  (void)references, (void)sizes, (void)values, (void)n;
  return no_such(c, count);
}
EXPORT int fmi3GetClock(C, VRS, bool *values) { (void)references, (void)values; return no_such(c, count); }
EXPORT int fmi3SetClock(C, VRS, const bool *values) { (void)references, (void)values; return no_such(c, count); }
EXPORT int fmi3GetNumberOfVariableDependencies(C, uint32_t reference, size_t *count) {
  (void)reference, (void)count;
  return not_offered(c, "dependencies of elements");
}
EXPORT int fmi3GetVariableDependencies(C, uint32_t reference, size_t *elements, uint32_t *independents, size_t *of, int *kinds, size_t n) {
  (void)reference, (void)elements, (void)independents, (void)of, (void)kinds, (void)n;
  return not_offered(c, "dependencies of elements");
}
EXPORT int fmi3GetFMUState(C, void **state) { return keep(c, state); }
EXPORT int fmi3SetFMUState(C, void *state) { return put(c, state); }
EXPORT int fmi3FreeFMUState(C, void **state) {
  (void)c;
  if (state) free(*state), *state = NULL;
  return OK;
}
EXPORT int fmi3SerializedFMUStateSize(C, void *state, size_t *size) {
  (void)c, (void)state;
  *size = sizeof(word) * (HEAD + (size_t)NUM_WORDS);
  return OK;
}
EXPORT int fmi3SerializeFMUState(C, void *state, uint8_t *bytes, size_t size) { return to_bytes(c, state, bytes, size); }
EXPORT int fmi3DeserializeFMUState(C, const uint8_t *bytes, size_t size, void **state) { return from_bytes(c, bytes, size, state); }
#define DERIVATIVE(NAME) \
  EXPORT int NAME(C, const uint32_t *u, size_t nu, const uint32_t *k, size_t nk, const double *seed, size_t ns, double *out, size_t no) { \
    (void)u, (void)nu, (void)k, (void)nk, (void)seed, (void)ns, (void)out, (void)no; \
    return not_offered(c, "derivatives"); \
  }
DERIVATIVE(fmi3GetDirectionalDerivative)
DERIVATIVE(fmi3GetAdjointDerivative)
EXPORT int fmi3GetIntervalDecimal(C, VRS, double *intervals, int *kinds) { (void)references, (void)intervals, (void)kinds; return no_such(c, count); }
EXPORT int fmi3GetIntervalFraction(C, VRS, uint64_t *a, uint64_t *b, int *kinds) { (void)references, (void)a, (void)b, (void)kinds; return no_such(c, count); }
EXPORT int fmi3GetShiftDecimal(C, VRS, double *shifts) { (void)references, (void)shifts; return no_such(c, count); }
EXPORT int fmi3GetShiftFraction(C, VRS, uint64_t *a, uint64_t *b) { (void)references, (void)a, (void)b; return no_such(c, count); }
EXPORT int fmi3SetIntervalDecimal(C, VRS, const double *intervals) { (void)references, (void)intervals; return no_such(c, count); }
EXPORT int fmi3SetIntervalFraction(C, VRS, const uint64_t *a, const uint64_t *b) { (void)references, (void)a, (void)b; return no_such(c, count); }
EXPORT int fmi3SetShiftDecimal(C, VRS, const double *shifts) { (void)references, (void)shifts; return no_such(c, count); }
EXPORT int fmi3SetShiftFraction(C, VRS, const uint64_t *a, const uint64_t *b) { (void)references, (void)a, (void)b; return no_such(c, count); }
EXPORT int fmi3EvaluateDiscreteStates(C) { return not_offered(c, "event mode"); }
EXPORT int fmi3UpdateDiscreteStates(C, bool *again, bool *stop, bool *nominals, bool *values, bool *has_next, double *next) {
  (void)again, (void)stop, (void)nominals, (void)values, (void)has_next, (void)next;
  return not_offered(c, "event mode");
}
EXPORT int fmi3GetOutputDerivatives(C, VRS, const int32_t *orders, double *values, size_t n) {
  (void)references, (void)orders, (void)values, (void)n;
  return count ? not_offered(c, "derivatives of outputs") : OK;
}
EXPORT int fmi3DoStep(C, double from, double step, bool no_way_back, bool *event, bool *stop, bool *early, double *reached) {
  (void)no_way_back;
  int status = advance(c, from, step);
  *event = false;
  *stop = c->ended;
  *early = false;
  *reached = status || c->ended ? host_time(c) : from + step;
  return status;
}
/* Of the other kinds of FMU; hosts that look up all names at once find them. */
EXPORT int fmi3EnterContinuousTimeMode(C) { return not_offered(c, "model exchange"); }
EXPORT int fmi3CompletedIntegratorStep(C, bool way, bool *event, bool *stop) { (void)way, (void)event, (void)stop; return not_offered(c, "model exchange"); }
EXPORT int fmi3SetTime(C, double time) { (void)time; return not_offered(c, "model exchange"); }
EXPORT int fmi3SetContinuousStates(C, const double *x, size_t n) { (void)x, (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3GetContinuousStateDerivatives(C, double *x, size_t n) { (void)x, (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3GetEventIndicators(C, double *x, size_t n) { (void)x, (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3GetContinuousStates(C, double *x, size_t n) { (void)x, (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3GetNominalsOfContinuousStates(C, double *x, size_t n) { (void)x, (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3GetNumberOfEventIndicators(C, size_t *n) { (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3GetNumberOfContinuousStates(C, size_t *n) { (void)n; return not_offered(c, "model exchange"); }
EXPORT int fmi3ActivateModelPartition(C, uint32_t clock, double time) { (void)clock, (void)time; return not_offered(c, "scheduled execution"); }

#endif
