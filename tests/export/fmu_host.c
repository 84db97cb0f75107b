/* Loads the DLL of a functional mock-up unit, steps it with inputs from stdin and prints its outputs.

   host DLL VERSION TOKEN INTERVAL INPUTS OUTPUTS REFERENCE... */
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

#define FUNCTION(name) name##TYPE *name##_ = (name##TYPE *)(void *)GetProcAddress(dll, #name)
#define CHECK(call) if ((call) != 0) { fprintf(stderr, "%s\n", #call); return 1; }

static void log2(void *environment, fmi2String instance, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)environment; (void)instance; (void)status; (void)category;
    fprintf(stderr, "%s\n", message);
}

static void log3(void *environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment; (void)status; (void)category;
    fprintf(stderr, "%s\n", message);
}

int main(int count, char **words)
{
    if (count < 7) return 2;
    const int second = words[2][0] == '2';
    const double interval = atof(words[4]);
    const size_t inputs = (size_t)atoi(words[5]), outputs = (size_t)atoi(words[6]);
    unsigned int references[64];
    double in[16], out[16], time = 0.0;
    for (size_t k = 0; k < inputs + outputs; k += 1) references[k] = (unsigned int)atoi(words[7 + k]);
    HMODULE dll = LoadLibraryA(words[1]);
    if (dll == NULL) { fprintf(stderr, "the library is not loaded\n"); return 1; }
    FUNCTION(fmi2Instantiate); FUNCTION(fmi2SetupExperiment); FUNCTION(fmi2EnterInitializationMode);
    FUNCTION(fmi2ExitInitializationMode); FUNCTION(fmi2SetReal); FUNCTION(fmi2GetReal);
    FUNCTION(fmi2DoStep); FUNCTION(fmi2Terminate); FUNCTION(fmi2FreeInstance);
    FUNCTION(fmi3InstantiateCoSimulation); FUNCTION(fmi3EnterInitializationMode);
    FUNCTION(fmi3ExitInitializationMode); FUNCTION(fmi3SetFloat64); FUNCTION(fmi3GetFloat64);
    FUNCTION(fmi3DoStep); FUNCTION(fmi3Terminate); FUNCTION(fmi3FreeInstance);
    const fmi2CallbackFunctions callbacks = {log2, calloc, free, NULL, NULL};
    void *unit;
    if (second) {
        unit = fmi2Instantiate_("unit", fmi2CoSimulation, words[3], "", &callbacks, 0, 0);
        if (unit == NULL) return 1;
        CHECK(fmi2SetupExperiment_(unit, 0, 0.0, 0.0, 0, 0.0));
        CHECK(fmi2EnterInitializationMode_(unit));
        CHECK(fmi2ExitInitializationMode_(unit));
    } else {
        unit = fmi3InstantiateCoSimulation_("unit", words[3], "", 0, 0, 0, 0, NULL, 0, NULL, log3, NULL);
        if (unit == NULL) return 1;
        CHECK(fmi3EnterInitializationMode_(unit, 0, 0.0, 0.0, 0, 0.0));
        CHECK(fmi3ExitInitializationMode_(unit));
    }
    for (long n = 0;; n += 1) {
        for (size_t k = 0; k < inputs; k += 1) if (scanf("%lf", &in[k]) != 1) goto end;
        time = (double)n * interval;
        if (second) {
            CHECK(fmi2SetReal_(unit, references, inputs, in));
            CHECK(fmi2DoStep_(unit, time, interval, 1));
            CHECK(fmi2GetReal_(unit, references + inputs, outputs, out));
        } else {
            fmi3Boolean event, ended, early; fmi3Float64 last;
            CHECK(fmi3SetFloat64_(unit, references, inputs, in, inputs));
            CHECK(fmi3DoStep_(unit, time, interval, 1, &event, &ended, &early, &last));
            CHECK(fmi3GetFloat64_(unit, references + inputs, outputs, out, outputs));
        }
        for (size_t k = 0; k < outputs; k += 1) printf("%.17g ", out[k]);
        printf("\n");
    }
end:
    if (second) { CHECK(fmi2Terminate_(unit)); fmi2FreeInstance_(unit); }
    else { CHECK(fmi3Terminate_(unit)); fmi3FreeInstance_(unit); }
    return 0;
}
