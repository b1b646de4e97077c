#include "simulate/simulator.h"
